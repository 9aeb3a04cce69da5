"""Moments at equal intervals."""

import jax.numpy as jnp

from acausal import Scalar

NEAR = 1e-6  # share of an interval: a moment this short before the next one is that one


def began(t: Scalar, start: Scalar, period: Scalar) -> Scalar:
    """The beginning of the present one of the intervals that begin at start, start + period, ..."""
    return start + period * jnp.floor((t - start) / period + NEAR)
