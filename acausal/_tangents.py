"""Tangents in rules of `jax.custom_jvp`, which can be symbolic zeros."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.custom_derivatives import SymbolicZero
from jaxtyping import PyTree

from ._numbers import Numbers


def array_of(tangent: Array | SymbolicZero) -> Numbers:
    """A tangent as an array; a symbolic zero becomes an array of zeros."""
    if not isinstance(tangent, SymbolicZero):
        return tangent
    aval: Any = tangent.aval
    zeros = np.zeros if aval.dtype == jax.dtypes.float0 else jnp.zeros
    return zeros(aval.shape, aval.dtype)


def pushed(
    function: Callable[..., Numbers], primals: tuple[PyTree, ...], tangents: tuple[PyTree, ...]
) -> tuple[Array, Array]:
    """`jax.jvp` along the leaves with a nonzero tangent only."""
    leaves, structure = jax.tree_util.tree_flatten(primals)
    directions = jax.tree_util.tree_leaves(tangents, is_leaf=lambda x: isinstance(x, SymbolicZero))
    moving = [i for i, direction in enumerate(directions) if not isinstance(direction, SymbolicZero)]

    def of_moving(*values: Array) -> Numbers:
        whole = list(leaves)
        for i, value in zip(moving, values, strict=True):
            whole[i] = value
        return function(*structure.unflatten(whole))

    return jax.jvp(of_moving, tuple(leaves[i] for i in moving), tuple(directions[i] for i in moving))
