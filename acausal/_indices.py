"""Constant indices of programs, and searches for an index."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
import numpy.typing as npt
from jax import Array
from jaxtyping import Bool, UInt32


def unsigned(indices: npt.ArrayLike) -> UInt32[np.ndarray, "..."]:
    """Unsigned indices: a lookup with them compiles no test for negative ones."""
    return np.asarray(indices, np.uint32)


def behind_filler(is_own: Bool[np.ndarray, "..."]) -> UInt32[np.ndarray, "..."]:
    """Indices into a vector that holds a filler value and then the values of the marked places.

    A place without a value of its own gets index 0, the filler.
    """
    return unsigned(np.where(is_own, np.cumsum(is_own).reshape(is_own.shape), 0))


def first_true(masks: Sequence[Array]) -> Array:
    """The index of the first true element of several masks in sequence, or their total length if there is none.

    The masks are not concatenated: XLA on the CPU compiles each part of a concatenation as a separate function, but
    operations on numbers as one.
    """
    total = found = sum(mask.size for mask in masks)
    for mask in reversed(masks):
        total -= mask.size
        if mask.size == 1:
            found = jnp.where(jnp.ravel(mask)[0], total, found)
        elif mask.size:
            found = jnp.where(jnp.any(mask), total + jnp.argmax(mask), found)
    return jnp.asarray(found)


def joined(masks: Sequence[Array]) -> Array:
    """Several masks as one vector."""
    return jnp.concatenate([jnp.zeros(0, bool), *(jnp.ravel(mask) for mask in masks)])
