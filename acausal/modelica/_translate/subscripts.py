"""Subscripts of arrays; Modelica counts from 1."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .values import Value, is_known, plain


def elements(value: Value, index: tuple[Any, ...]) -> Value:
    """The elements of an array at an index: a position or an array of positions, or a slice, for each axis."""
    if any(isinstance(item, jax.Array) for item in index):
        value = jnp.asarray(value)
    if any(isinstance(item, np.ndarray) for item in index) and len(index) > 1:
        for axis, item in reversed(list(enumerate(index))):
            value = value[(slice(None),) * axis + (item,)]
        return plain(value)
    if isinstance(value, jax.Array) and value.dtype == float:
        return value.at[index].get(mode="fill", fill_value=jnp.nan, wrap_negative_indices=False)
    return plain(value[index])


def position(subscript: Value) -> Any:
    """The position, counted from 0, that a subscript means."""
    if isinstance(subscript, bool):
        return int(subscript)  # Boolean subscripts count false, true
    if isinstance(subscript, np.ndarray):
        return subscript.astype(int) - 1
    if is_known(subscript):
        return int(subscript) - 1
    return jnp.round(subscript).astype(int) - 1
