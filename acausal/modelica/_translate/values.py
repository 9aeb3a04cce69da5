"""Values of Modelica expressions: plain Python values as long as they are known, otherwise arrays of jax.

A known scalar is a bool, int, float or str, a known array is a NumPy array, a record is a dictionary.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from ..._errors import ModelError

Value: TypeAlias = Any
ZEROS: dict[str, Value] = {"Real": 0.0, "Integer": 0, "Boolean": False, "String": ""}  # by type


class UnknownText(str):
    """A text that depends on variables, with dots in their place. Messages may show it; no relation can read it."""

    __slots__ = ()

    def __add__(self, other: str) -> "UnknownText":
        return UnknownText(str.__add__(self, other))

    def __radd__(self, other: str) -> "UnknownText":
        return UnknownText(str.__add__(other, self))


def is_known(value: Value) -> bool:
    """Whether a value is known while equations are translated."""
    return not isinstance(value, jax.Array)


def plain(value: Value) -> Value:
    """A known scalar as a Python value."""
    if isinstance(value, np.generic) or (isinstance(value, np.ndarray) and value.ndim == 0):
        return value.item()
    return value


def by_field(value: Value, change: Callable[[Value], Value]) -> Value:
    """A value changed; of a record, each of its fields."""
    return {name: by_field(item, change) for name, item in value.items()} if isinstance(value, dict) else change(value)


def shape_of(value: Value) -> tuple[int, ...]:
    """The shape of an array; of an array of records, that of its first field, which may have further dimensions."""
    while isinstance(value, dict):
        value = next(iter(value.values()), 0)
    return np.shape(value)


def stacked(values: Sequence[Value]) -> Value:
    """An array of values of one shape; of records, a record of arrays."""
    if values and isinstance(values[0], dict):
        return {name: stacked([value[name] for value in values]) for name in values[0]}
    if all(is_known(value) for value in values):
        return np.array(values) if values else np.zeros(0)
    return jnp.stack([jnp.asarray(value) for value in values])


def items_of(value: Value) -> list[Value]:
    """The elements of an array along its first dimension; records, of an array of records."""
    if isinstance(value, dict):
        fields = {name: items_of(item) for name, item in value.items()}
        return [dict(zip(fields, row, strict=True)) for row in zip(*fields.values(), strict=True)]
    return [plain(item) for item in value]


def first(value: Value) -> Value:
    """Of several results of a function the first one."""
    return value[0] if isinstance(value, tuple) else value


def select(condition: Value, a: Value, b: Value) -> Value:
    """`a` if the condition holds, otherwise `b`, element by element of records and tuples."""
    if is_known(condition):
        return a if condition else b
    if isinstance(a, dict):
        return {name: select(condition, a[name], b[name]) for name in a}
    if isinstance(a, tuple) != isinstance(b, tuple):
        a, b = first(a), first(b)
    if isinstance(a, tuple):
        return tuple(select(condition, x, y) for x, y in zip(a, b, strict=False))
    if a is b or b is None:
        return b
    if isinstance(a, str):
        return a if a == b else UnknownText("...")
    return jnp.where(condition, a, b)


def number(value: Value) -> Value:
    """A truth as the number 1 or 0; numbers unchanged."""
    if isinstance(value, bool | np.bool_):
        return float(value)
    if isinstance(value, jax.Array | np.ndarray) and value.dtype == bool:
        return value.astype(float)
    return value


def product(a: Value, b: Value) -> Value:
    """Modelica's `*`: of numbers, of a number and an array, or of vectors and matrices."""
    if np.ndim(a) == 0 or np.ndim(b) == 0:
        return a * b
    if is_known(a) and is_known(b):
        return plain(np.dot(a, b))
    return jnp.dot(a, b)


def power(a: Value, b: Value) -> Value:
    """`a ^ b` of numbers, or the product of b factors that are square matrices."""
    if np.ndim(a) == 2:
        if not is_known(b):
            raise ModelError("the exponent of a matrix must be known when the model is loaded.")
        return np.linalg.matrix_power(a, int(b)) if is_known(a) else jnp.linalg.matrix_power(a, int(b))
    return element_power(a, b)


def element_power(a: Value, b: Value) -> Value:
    """`a .^ b`, element by element; whole exponents that are known need no logarithm."""
    b = plain(b)
    if not is_known(a) and isinstance(b, int | float) and float(b).is_integer() and abs(b) < 1024:
        return jnp.asarray(a, float) ** int(b)
    if is_known(a) and is_known(b):
        with np.errstate(all="ignore"):
            return plain(np.power(np.asarray(a, float), b))
    return jnp.power(a, b)


def function(known: Callable[..., Any], traced: Callable[..., Any]) -> Callable[..., Value]:
    """A function that stays in Python as long as its arguments are known numbers."""

    def call(*args: Value) -> Value:
        if all(isinstance(arg, bool | int | float) for arg in args):
            try:
                return known(*args)
            except (ValueError, OverflowError, ZeroDivisionError):
                return math.nan
        if all(is_known(arg) for arg in args):
            with np.errstate(all="ignore"):
                return plain(getattr(np, traced.__name__)(*args))
        return traced(*args)

    return call


def elements(value: Value, index: tuple[Any, ...]) -> Value:
    """The elements of an array at an index: a position or an array of positions, or a slice, for each axis."""
    if all(not isinstance(item, jax.Array) for item in index):
        return plain(value[by_axes(index, np.shape(value))])  # of a traced array, a slice: it reads no other element
    value = jnp.asarray(value)
    index = by_axes(index, value.shape)
    if value.dtype == float:
        return value.at[index].get(mode="fill", fill_value=jnp.nan, wrap_negative_indices=False)
    return value[index]


def by_axes(index: tuple[Any, ...], shape: tuple[int, ...]) -> tuple[Any, ...]:
    """An index of which each array counts for its own axis, as in Modelica, not for the elements of the others."""
    rest = sum(np.ndim(item) for item in index if not isinstance(item, slice))
    if rest == 0 or len(index) == 1:
        return index
    rest += sum(isinstance(item, slice) for item in index)
    found = []
    for item, size in zip(index, shape, strict=False):
        axis = np.arange(size)[item] if isinstance(item, slice) else item
        if np.ndim(axis):
            rest -= 1
            axis = axis.reshape(-1, *(1,) * rest)
        found.append(axis)
    return tuple(found)


def position(subscript: Value) -> Any:
    """The position, counted from 0, that a subscript means."""
    if isinstance(subscript, bool):
        return int(subscript)  # Boolean subscripts count false, true
    if isinstance(subscript, np.ndarray):
        return subscript.astype(int) - 1
    if is_known(subscript):
        return int(subscript) - 1
    return jnp.round(subscript).astype(int) - 1
