"""Moments at equal intervals."""

from typing import Any

import jax.numpy as jnp

from acausal import Scalar

NEAR = 1e-6  # share of an interval: a moment this short before the next one is that one


def is_due(t: Scalar, start: Scalar, period: Scalar, passed: Scalar) -> Any:
    """Whether it is time for the next of the moments start, start + period, ..., of which some have passed."""
    return t > start + passed * period


def count(t: Scalar, start: Scalar, period: Scalar) -> Scalar:
    """How many of them have passed, the present one included."""
    return jnp.floor((t - start) / period + NEAR) + 1.0
