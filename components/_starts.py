"""Start positions of bodies."""

import dataclasses
from typing import Any, TypeVar

from acausal import ArgumentError, Component, Port

P = TypeVar("P", bound=Port)


def placed(owner: Component, kind: type[P], name: str, value: Any, flange: P | None) -> P:
    """A flange with the start value given separately or by the flange itself; raises `ArgumentError` if both are."""
    if value is None:
        return kind() if flange is None else flange
    if flange is not None and getattr(flange, name) is not None:
        raise ArgumentError(
            f"{type(owner).__name__} takes its start from {name}=... or from a=Flange({name}=...), not from both."
        )
    return dataclasses.replace(kind() if flange is None else flange, **{name: value})
