"""Continuous piecewise functions: bounds and absolute value."""

from acausal import Scalar, ifelse


def limited(x: Scalar, low: Scalar, high: Scalar) -> Scalar:
    """x, limited to the interval from low to high."""
    # Not jnp.clip: its derivative at a bound is one half.
    return ifelse(x < low, low, ifelse(x > high, high, x))


def absolute(x: Scalar) -> Scalar:
    """|x|, with a one-sided slope at zero."""
    return ifelse(x < 0.0, -x, x)


def positive_part(x: Scalar) -> Scalar:
    """x if positive, otherwise 0."""
    return ifelse(x > 0.0, x, 0.0)
