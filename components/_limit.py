"""Laws in pieces that are continuous: bounds and sizes."""

from acausal import Scalar, ifelse


def limited(x: Scalar, low: Scalar, high: Scalar) -> Scalar:
    """x, or the bound that it is beyond."""
    # Not jnp.clip, whose derivative at a bound is one half.
    return ifelse(x < low, low, ifelse(x > high, high, x))


def absolute(x: Scalar) -> Scalar:
    """|x|, whose slope is that of one side at zero, too."""
    return ifelse(x < 0.0, -x, x)


def positive_part(x: Scalar) -> Scalar:
    """x above zero, else 0."""
    return ifelse(x > 0.0, x, 0.0)
