"""A value kept within bounds."""

import jax.numpy as jnp

from acausal import Scalar


def limited(x: Scalar, low: Scalar, high: Scalar) -> Scalar:
    """x, or the bound that it is beyond."""
    # Not jnp.clip, whose derivative at a bound is one half.
    return jnp.where(x < low, low, jnp.where(x > high, high, x))
