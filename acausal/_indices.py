"""Indices as constants of programs, and what is found by them."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
import numpy.typing as npt
from jax import Array
from jaxtyping import Bool, UInt32


def unsigned(indices: npt.ArrayLike) -> UInt32[np.ndarray, "..."]:
    """Indices that cannot be negative, so that looking them up needs no operation that asks."""
    return np.asarray(indices, np.uint32)


def behind_filler(is_own: Bool[np.ndarray, "..."]) -> UInt32[np.ndarray, "..."]:
    """Where each place finds its value in a vector of a filler and, behind it, the values of the places that are
    their own; the others find the filler.
    """
    return unsigned(np.where(is_own, np.cumsum(is_own).reshape(is_own.shape), 0))


def first_true(masks: Sequence[Array]) -> Array:
    """The index of the first element that holds of several masks, one behind the other; their number if none does.

    They are not put together: XLA on the CPU compiles each part of a vector as a function of its own, but operations on
    numbers as one.
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
