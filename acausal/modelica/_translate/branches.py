"""A choice between two computations of which only the chosen one is made.

`where` computes both sides, and the derivative of a side that is not chosen, such as the root of a negative number,
spoils that of the other one in reverse mode.
"""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..._errors import ModelError
from ..._jax_private import jaxpr_as_fun
from .values import Value, first, is_known

# Operations with finite values and derivatives: a few of them are computed on both sides.
_HARMLESS = frozenset(
    "abs add and atan broadcast_in_dim clamp concatenate convert_element_type copy cos dot_general dynamic_slice eq "
    "floor gather ge gt iota le lt max min mul ne neg not or reduce_max reduce_min reduce_sum reshape round select_n "
    "sign sin slice squeeze sub tanh transpose".split()
)
_FEW = 30


class Failed(ModelError):
    """A violated assertion, or a subscript out of bounds."""


@dataclasses.dataclass(frozen=True)
class HeldValue:
    """The place of an array in a list."""

    number: int


@dataclasses.dataclass(frozen=True)
class _Side:
    """A computation as a program for its arrays, and its values with places instead of the arrays."""

    program: Any
    values: Value
    traced: Sequence[jax.Array]

    @classmethod
    def of(cls, compute: Callable[[], Value]) -> "_Side":
        values: list[Value] = []
        traced: list[jax.Array] = []

        def arrays() -> list[jax.Array]:
            values.append(without_arrays(compute(), traced))
            return traced

        return cls(jax.make_jaxpr(arrays)(), values[0], traced)

    def is_harmless(self) -> bool:
        equations = self.program.jaxpr.eqns
        return len(equations) <= _FEW and all(equation.primitive.name in _HARMLESS for equation in equations)

    def arrays(self) -> list[Any]:
        return jaxpr_as_fun(self.program)()

    def type_of(self, value: Any) -> tuple[Any, tuple[int, ...]]:
        """The type and shape of one of its values."""
        if isinstance(value, HeldValue):
            kind = self.program.out_avals[value.number]
            return kind.dtype, kind.shape
        return jnp.result_type(value), np.shape(value)


def without_arrays(value: Value, arrays: list[jax.Array]) -> Value:
    """A value whose arrays are moved to a list."""
    if isinstance(value, dict):
        return {name: without_arrays(item, arrays) for name, item in value.items()}
    if isinstance(value, tuple):
        return tuple(without_arrays(item, arrays) for item in value)
    if is_known(value):
        return value
    arrays.append(value)
    return HeldValue(len(arrays) - 1)


def with_arrays(value: Value, arrays: Sequence[Any]) -> Value:
    """A value with its arrays in their places."""
    if isinstance(value, dict):
        return {name: with_arrays(item, arrays) for name, item in value.items()}
    if isinstance(value, tuple):
        return tuple(with_arrays(item, arrays) for item in value)
    return arrays[value.number] if isinstance(value, HeldValue) else value


def choose(truth: Any, first: Callable[[], Value], second: Callable[[], Value]) -> Value:
    """The value of `first` if an unknown condition holds, otherwise that of `second`. Records and tuples are chosen
    part by part; parts that are known and equal stay known. A side that violates an assertion is not a number.
    """
    a, b = _attempt(first), _attempt(second)
    if isinstance(a, Failed) and isinstance(b, Failed):
        raise a
    if isinstance(a, Failed) or isinstance(b, Failed):
        return _spoilt(a, b, truth)
    pairs: list[tuple[Any, Any]] = []
    merged = _merged(_outer(a, b), _outer(b, a), pairs)
    if not pairs:
        return merged
    types = [_common(a.type_of(x), b.type_of(y)) for x, y in pairs]
    left = _outputs(a, [x for x, _ in pairs], types)
    right = _outputs(b, [y for _, y in pairs], types)
    if a.is_harmless() and b.is_harmless():
        return with_arrays(merged, [jnp.where(truth, x, y) for x, y in zip(left(), right(), strict=True)])
    return with_arrays(merged, jax.lax.cond(truth if truth.ndim == 0 else truth.reshape(()), left, right))


def _attempt(compute: Callable[[], Value]) -> _Side | Failed:
    try:
        return _Side.of(compute)
    except Failed as failed:
        return failed


def _spoilt(a: _Side | Failed, b: _Side | Failed, truth: Any) -> Value:
    """The value of the side that did not fail; not a number where the other one is chosen."""
    side, fails = (b, truth) if isinstance(a, Failed) else (a, jnp.logical_not(truth))
    assert isinstance(side, _Side)
    arrays = [jnp.where(fails, jnp.nan, x) if x.dtype == float else x for x in side.arrays()]
    return with_arrays(side.values, arrays)


def _outer(side: _Side, other: _Side) -> Value:
    """The values of a side, with the arrays themselves where the other side has the same ones."""
    shared = {id(array) for array in other.traced}
    return with_arrays(side.values, [x if id(x) in shared else HeldValue(i) for i, x in enumerate(side.traced)])


def _merged(a: Value, b: Value, pairs: list[tuple[Any, Any]]) -> Value:
    """The parts that are equal, and the others as places in a list of pairs."""
    if isinstance(a, dict) and isinstance(b, dict):
        # A name that only one side has is not read where the other one is chosen.
        a, b = {**_absent(b), **a}, {**_absent(a), **b}
        return {name: _merged(a[name], b[name], pairs) for name in a}
    if isinstance(a, tuple) != isinstance(b, tuple):
        a, b = first(a), first(b)
    if isinstance(a, tuple) and isinstance(b, tuple):  # results that only one side has are not read
        return tuple(_merged(x, y, pairs) for x, y in zip(a, b, strict=False))
    if a is None or b is None:
        return None
    if not isinstance(a, HeldValue) and not isinstance(b, HeldValue) and _is_same(a, b):
        return a
    pairs.append((a, b))
    return HeldValue(len(pairs) - 1)


def _absent(value: Value) -> Value:
    """A value with zeros instead of its arrays."""
    if isinstance(value, dict):
        return {name: _absent(item) for name, item in value.items()}
    if isinstance(value, tuple):
        return tuple(_absent(item) for item in value)
    return False if isinstance(value, HeldValue) else value


def _is_same(a: Value, b: Value) -> bool:
    """Whether arrays are the same, or known values are equal or no numbers."""
    if a is b or not (is_known(a) and is_known(b)):
        return a is b
    numbers = bool | int | float | np.ndarray
    if not isinstance(a, numbers) or not isinstance(b, numbers):
        return True
    return type(a) is type(b) and np.shape(a) == np.shape(b) and bool(np.all(a == b))


def _common(a: tuple[Any, Any], b: tuple[Any, Any]) -> tuple[Any, tuple[int, ...]]:
    return jnp.promote_types(a[0], b[0]), np.broadcast_shapes(a[1], b[1])


def _outputs(side: _Side, values: list[Any], types: list[tuple[Any, Any]]) -> Callable[[], list[jax.Array]]:
    def computed() -> list[jax.Array]:
        arrays = side.arrays()
        return [
            jnp.broadcast_to(jnp.asarray(with_arrays(value, arrays), dtype), shape)
            for value, (dtype, shape) in zip(values, types, strict=True)
        ]

    return computed
