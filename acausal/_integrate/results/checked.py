"""Numbers with a check that raises an error when they are computed, also within transformations of jax."""

from collections.abc import Sequence
from typing import TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array

from ..._equinox_private import unvmap_any

T = TypeVar("T")


def checked(tree: T, is_bad: Array, index: Array, texts: Sequence[str]) -> T:
    """The tree, with an error if it `is_bad`, or if any member of a batch is. `index` selects its message.

    A check executes only if its output is used. Derivatives do not use the values. Therefore, each real number in the
    tree is multiplied by a checked 1, which is also a factor of all derivatives, in both modes.
    """
    real, others = eqx.partition(tree, eqx.is_inexact_array)
    checks = jnp.asarray(1.0), jax.tree.leaves(others)
    one, leaves = eqx.branched_error_if(checks, is_bad, _largest(index, is_bad, len(texts)), texts)
    real = jax.tree.map(lambda x: x * one.astype(x.dtype), real)
    return eqx.combine(real, jax.tree.unflatten(jax.tree.structure(others), leaves))


def _largest(index: Array, is_bad: Array, count: int) -> Array:
    """The largest index of the bad members of a batch, bit by bit; 0 if there are none, as in an empty batch."""
    largest = jnp.asarray(0)
    for bit in reversed(range((count - 1).bit_length())):
        is_set = (index >> bit) & 1 == 1
        is_any = unvmap_any(is_bad & is_set)
        largest, is_bad = largest + (is_any << bit), is_bad & (is_set == is_any)
    return largest
