"""Subscripts of arrays; Modelica counts from 1."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .values import Value, is_known, plain


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
