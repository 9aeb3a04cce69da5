"""Periodic instants."""

import jax.numpy as jnp

from acausal import Scalar

NEAR = 1e-6  # fraction of a period: a time this close before the next instant counts as that instant


def began(t: Scalar, start: Scalar, period: Scalar) -> Scalar:
    """Start of the current period; the periods start at start, start + period, ..."""
    return start + period * jnp.floor((t - start) / period + NEAR)
