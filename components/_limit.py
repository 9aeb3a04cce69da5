"""Continuous piecewise functions: bounds and absolute value."""

import jax.numpy as jnp

from acausal import Scalar, ifelse


def limited(x: Scalar, low: Scalar, high: Scalar) -> Scalar:
    """x, limited to the interval from low to high."""
    # Not jnp.clip: its derivative at a bound is one half.
    return ifelse(x < low, low, ifelse(x > high, high, x))


def limited_amplitude(x: Scalar, y: Scalar, most: Scalar) -> tuple[Scalar, Scalar]:
    """The vector (x, y), limited in amplitude to `most`."""
    square = x**2 + y**2
    # The maximum keeps the derivative of the root finite at zero.
    size = ifelse(square > most**2, jnp.sqrt(jnp.maximum(square, most**2)), most)
    return most / size * x, most / size * y


def absolute(x: Scalar) -> Scalar:
    """|x|, with a one-sided slope at zero."""
    return ifelse(x < 0.0, -x, x)


def positive_part(x: Scalar) -> Scalar:
    """x if positive, otherwise 0."""
    return ifelse(x > 0.0, x, 0.0)
