"""Visits of the parts of expressions and statements."""

import dataclasses
import functools as ft
from collections.abc import Callable
from typing import Any


def parts_of(x: Any) -> list[Any]:
    """The expressions and statements directly inside one, or those of a tuple."""
    found: list[Any] = []
    for value in x if isinstance(x, tuple) else (getattr(x, name) for name in _fields(type(x))):
        if isinstance(value, tuple):
            found += parts_of(value)
        elif dataclasses.is_dataclass(value):
            found.append(value)
    return found


def mapped(x: Any, change: Callable[[Any], Any]) -> Any:
    """An expression, a statement or a tuple of them, with the parts directly inside changed."""
    if isinstance(x, tuple):
        new = tuple(_changed(item, change) for item in x)
        return x if all(a is b for a, b in zip(new, x, strict=True)) else new
    old = {name: getattr(x, name) for name in _fields(type(x))}
    changes = {name: new for name, value in old.items() if (new := _changed(value, change)) is not value}
    return dataclasses.replace(x, **changes) if changes else x


def _changed(value: Any, change: Callable[[Any], Any]) -> Any:
    if isinstance(value, tuple):
        return mapped(value, change)
    return change(value) if dataclasses.is_dataclass(value) else value


@ft.cache
def _fields(cls: type) -> tuple[str, ...]:
    """The fields with parts. A field that does not take part in comparisons, such as a table, has none."""
    return tuple(field.name for field in dataclasses.fields(cls) if field.compare)
