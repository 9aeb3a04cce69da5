"""The fields of a class of nodes."""

import dataclasses
import functools as ft
from typing import Any

from .annotations import Declaration


def dynamic_fields(cls: type) -> tuple[tuple[str, Declaration | None], ...]:
    """Names of a class's leaves and parts in pytree order, each leaf with its declaration, a part with None."""
    return _dynamic_fields(cls)  # whose own signature would refuse classes with `__eq__` and without `__hash__`


@ft.cache
def _dynamic_fields(cls: Any) -> tuple[tuple[str, Declaration | None], ...]:
    fields = [f for f in dataclasses.fields(cls) if not f.metadata.get("static") and not f.metadata.get("is_past")]
    return tuple((field.name, field.metadata.get("declaration")) for field in fields)


def join(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name
