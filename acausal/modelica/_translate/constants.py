"""Terms of known values."""

from typing import Any

import numpy as np

from .._syntax import expressions as e
from .terms import Opaque, RecordOf
from .values import Value


def zeros(dims: tuple[int, ...]) -> e.Expression:
    """Zeros of a shape."""
    return e.Builtin("Zeros", tuple(map(e.Const, dims))) if dims else e.Const(0.0)


def constant(value: Value, key: str) -> Any:
    """A known value as a term."""
    if isinstance(value, bool | int | float | str):
        return e.Const(value)
    if isinstance(value, np.ndarray):
        return Opaque(f"{value.dtype}{value.tolist()}", value)
    if isinstance(value, dict):
        return RecordOf(tuple((name, constant(item, f"{key}.{name}")) for name, item in value.items()))
    return Opaque(f"{key} {value!r}", value)
