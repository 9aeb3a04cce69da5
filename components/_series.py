"""Quotients that are 0/0 at zero, evaluated there by their series."""

import jax.numpy as jnp

from acausal import Scalar

_NEAR = 1e-4  # below this, the truncation error of the series is less than rounding


def log1p_over(y: Scalar) -> Scalar:
    """ln(1 + y)/y."""
    is_near = jnp.abs(y) < _NEAR
    guarded = jnp.where(is_near, 1.0, y)
    return jnp.where(is_near, 1.0 - y * (1.0 / 2.0 - y * (1.0 / 3.0 - y / 4.0)), jnp.log1p(guarded) / guarded)


def expm1_over(y: Scalar) -> Scalar:
    """(exp(y) - 1)/y."""
    is_near = jnp.abs(y) < _NEAR
    guarded = jnp.where(is_near, 1.0, y)
    return jnp.where(is_near, 1.0 + y * (1.0 / 2.0 + y * (1.0 / 6.0 + y / 24.0)), jnp.expm1(guarded) / guarded)
