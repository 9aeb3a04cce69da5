"""Programs of functions, which are traced once for each shape of their arguments."""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import jax
import numpy as np

from .._syntax.flat import FlatFunction
from .._syntax.visits import nodes
from .branches import with_arrays, without_arrays
from .values import Value

_LARGE = 30


class TracedFunction:
    """A function of arrays whose results are values; those that are known are found when it is traced."""

    def __init__(self, name: str, compute: Callable[[Sequence[Any]], Value]) -> None:
        self._values: Value = None

        def run(arrays: list[jax.Array]) -> list[jax.Array]:
            found: list[jax.Array] = []
            self._values = without_arrays(compute(arrays), found)
            return found

        run.__name__ = name.replace(".", "_")
        self._run = jax.jit(run)

    def __call__(self, arrays: list[jax.Array]) -> Value:
        found = self._run(arrays)
        return with_arrays(self._values, found)


def hashable(value: Value) -> Any:
    """A known value as a key."""
    if isinstance(value, dict):
        return tuple((name, hashable(item)) for name, item in value.items())
    if isinstance(value, tuple | list):
        return tuple(hashable(item) for item in value)
    if isinstance(value, np.ndarray):
        return value.shape, value.dtype.str, value.tobytes()
    return type(value), value


@cache
def is_large(function: FlatFunction) -> bool:
    """Whether a body is worth a program of its own."""
    return sum(1 for _ in nodes(function.body)) >= _LARGE
