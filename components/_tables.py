"""Interpolation of sampled values: piecewise cubics in Hermite form, traceable in the samples.

Between knots x_0 and x_1 = x_0 + h with values y and slopes m, u = x - x_0 and the chord slope D = (y_1 - y_0)/h:
y = y_0 + m_0 u + (3 D - 2 m_0 - m_1)/h u^2 + (m_0 + m_1 - 2 D)/h^2 u^3.
"""

from typing import TypeAlias

import jax.numpy as jnp
from jax import Array

from acausal import Scalar, Vector, segment

Cubic: TypeAlias = tuple[Array, Array, Array, Array]  # coefficients, lowest power first


def interval(x: Scalar, knots: Vector) -> Array:
    """Index of the interval that contains x; the first or last one if x is outside."""
    return jnp.sum(x >= knots[1:-1])


def cubic(coefficients: Cubic | Array, u: Scalar) -> Scalar:
    """Value of the cubic with the given coefficients."""
    c0, c1, c2, c3 = coefficients
    return c0 + u * (c1 + u * (c2 + u * c3))


def _slope(coefficients: Cubic | Array, u: Scalar) -> Scalar:
    _, c1, c2, c3 = coefficients
    return c1 + u * (2.0 * c2 + u * 3.0 * c3)


def _area(coefficients: Cubic | Array, u: Scalar) -> Scalar:
    """Integral of the cubic from 0 to u."""
    c0, c1, c2, c3 = coefficients
    return u * (c0 + u * (c1 / 2.0 + u * (c2 / 3.0 + u * c3 / 4.0)))


def hermite(y0: Array, y1: Array, m0: Array, m1: Array, h: Array) -> Cubic:
    """Coefficients of the cubic with the given end values and slopes on an interval of length h."""
    chord = (y1 - y0) / h
    return y0, m0, (3.0 * chord - 2.0 * m0 - m1) / h, (m0 + m1 - 2.0 * chord) / h**2


def _monotone_slope(left: Array, right: Array, h_left: Array, h_right: Array) -> Array:
    """Slope at a knot: weighted harmonic mean of the two chord slopes, 0 at an extremum (Fritsch, Butland 1984)."""
    w_left, w_right = 2.0 * h_right + h_left, h_right + 2.0 * h_left
    same = left * right > 0.0
    denominator = jnp.where(same, w_left * right + w_right * left, 1.0)
    return jnp.where(same, (w_left + w_right) * left * right / denominator, 0.0)


def _monotone_cubics(knots: Vector, values: Vector, i: Array) -> Cubic:
    """Coefficients on the intervals i. The slope at each end of the table is that of the outermost chord."""

    def chord(j: Array) -> tuple[Array, Array]:
        j = jnp.clip(j, 0, len(knots) - 2)
        h = knots[j + 1] - knots[j]
        return (values[j + 1] - values[j]) / h, h

    (before, h_before), (here, h), (after, h_after) = chord(i - 1), chord(i), chord(i + 1)
    m0 = _monotone_slope(before, here, h_before, h)
    m1 = _monotone_slope(here, after, h, h_after)
    return hermite(values[i], values[i + 1], m0, m1, h)


def clamped(x: Scalar, knots: Vector) -> Scalar:
    """x, limited to the range of the table."""
    # Not jnp.clip: its derivative at a bound is one half.
    return jnp.where(x < knots[0], knots[0], jnp.where(x > knots[-1], knots[-1], x))


def located(x: Scalar, knots: Vector) -> tuple[Scalar, Array]:
    """x, limited to the range of the table, and the index of its interval. Both stay in the same case between events,
    so that a curve continues smoothly beyond the ends of its interval.
    """
    n, passed = len(knots), segment(x, knots)
    inside = jnp.where(passed == 0, knots[0], jnp.where(passed == n, knots[-1], x))
    return inside, jnp.clip(passed - 1, 0, n - 2)


def monotone_cubic(x: Scalar, knots: Vector, values: Vector) -> Scalar:
    """Curve with continuous slope that rises and falls only where the samples do; linear beyond the table."""
    inside, i = located(x, knots)
    coefficients, u = _monotone_cubics(knots, values, i), inside - knots[i]
    return cubic(coefficients, u) + _slope(coefficients, u) * (x - inside)


def monotone_cubic_of(x: Scalar, knots: Vector, values: Vector, i: Array) -> Scalar:
    """The cubic of `monotone_cubic` on interval i."""
    return cubic(_monotone_cubics(knots, values, i), x - knots[i])


def monotone_cubic_integral(x: Scalar, knots: Vector, values: Vector) -> Scalar:
    """Integral of `monotone_cubic` from the first knot to x."""
    inside, i = located(x, knots)
    intervals = jnp.arange(len(knots) - 1)
    coefficients = _monotone_cubics(knots, values, intervals)
    whole = jnp.sum(jnp.where(intervals < i, _area(coefficients, jnp.diff(knots)), 0.0))
    c0, c1, c2, c3 = coefficients
    here, u, outside = (c0[i], c1[i], c2[i], c3[i]), inside - knots[i], x - inside
    return whole + _area(here, u) + outside * (cubic(here, u) + 0.5 * _slope(here, u) * outside)


def _weight_last(weights: Array, values: Array) -> Array:
    """Weights along the first axis, reshaped to broadcast over the other axes of the values."""
    return jnp.reshape(weights, weights.shape + (1,) * (values.ndim - 1))


def linear(x: Scalar, knots: Vector, values: Array) -> Array:
    """Linear interpolation along the first axis of the values, and linear extrapolation beyond the table."""
    return line_of(x, knots, values, located(x, knots)[1])


def line_of(x: Scalar, knots: Vector, values: Array, i: Array) -> Array:
    """The line through the samples of interval i."""
    share = (x - knots[i]) / (knots[i + 1] - knots[i])
    return values[i] + share * (values[i + 1] - values[i])


def cubic_in_samples(x: Scalar, knots: Vector, values: Array) -> Array:
    """Curve with continuous slope along the first axis of the values, linear in the values; linear beyond the table.

    The slope at a knot is that of the parabola through it and its neighbours; at an end of the table, that of the
    outermost chord. Linear in the values, it gives a surface with continuous slope when applied axis by axis.
    """
    (inside, i), h = located(x, knots), jnp.diff(knots)
    chords = jnp.diff(values, axis=0) / _weight_last(h, values)
    left, right = _weight_last(h[:-1], values), _weight_last(h[1:], values)
    inner = (right * chords[:-1] + left * chords[1:]) / (left + right)
    slopes = jnp.concatenate([chords[:1], inner, chords[-1:]])
    coefficients = hermite(values[i], values[i + 1], slopes[i], slopes[i + 1], h[i])
    u = inside - knots[i]
    return jnp.asarray(cubic(coefficients, u) + _slope(coefficients, u) * (x - inside))


def periodic_spline(knots: Vector, values: Vector) -> Array:
    """Coefficients of the periodic cubic spline (continuous curvature): four rows, one column for each interval.

    The second derivative is continuous at knot i if, with the interval h and chord slope D on its left and right,
    h_r m_(i-1) + 2 (h_l + h_r) m_i + h_l m_(i+1) = 3 (h_r D_l + h_l D_r).
    """
    h = jnp.diff(knots)
    chords = jnp.diff(values) / h
    left, chords_left = jnp.roll(h, 1), jnp.roll(chords, 1)
    n = len(h)
    identity = jnp.eye(n)
    matrix = (
        h[:, None] * jnp.roll(identity, -1, axis=1)
        + 2.0 * (left + h)[:, None] * identity
        + left[:, None] * jnp.roll(identity, 1, axis=1)
    )
    slopes = jnp.linalg.solve(matrix, 3.0 * (h * chords_left + left * chords))
    return jnp.stack(hermite(values[:-1], values[1:], slopes, jnp.roll(slopes, -1), h))
