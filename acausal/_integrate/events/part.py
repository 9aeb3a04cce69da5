"""Event indicators on a part of a step, given their values and rates at its ends."""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from ..._numbers import Numbers
from ..step.interval import over


class Part(NamedTuple):
    """Values `q` and rates `p` of event indicators at both ends of an interval. Their signs are such that a function
    becomes positive when its relation changes.
    """

    q0: Array
    q1: Array
    p0: Array
    p1: Array
    width: Array

    def bumps(self, band: Array) -> Array:
        """Relations that may change and change back: the tangents at both ends intersect beyond zero and the band."""
        q0, q1, p0, p1, width = self
        q0, q1 = q0 - band, q1 - band
        points = (q0 <= 0) & (q1 <= 0) & (p0 > 0) & (p1 < 0)
        return points & (q0 + p0 * (q1 - q0 - p1 * width) / jnp.where(points, p0 - p1, 1.0) > 0)

    @property
    def leaps(self) -> Array:
        """Event indicators that a stair function, such as floor, may take beyond zero. They may jump, so the tangent
        at each end is tested separately.
        """
        q0, q1, p0, p1, width = self
        return (q0 <= 0) & (q1 <= 0) & ((q0 + p0 * width > 0) | (q1 - p1 * width > 0))

    @property
    def near(self) -> Array:
        """Event indicators that may reach zero, with a variation estimated from values and rates at the ends."""
        q0, q1, p0, p1, width = self
        nearest = jnp.maximum(q0, q1)
        variation = jnp.abs(q1 - q0) + width * (jnp.abs(p0) + jnp.abs(p1))
        return ~((nearest + variation < 0) | (nearest == -jnp.inf))

    def aim(self, changes: Array, bumps: Array, short: Numbers, count: Array) -> Array:
        """Relative position of the next evaluation: alternately just before and just after the estimated zero, or at
        the estimated extremum. Every fifth evaluation is a bisection.
        """
        q0, q1, p0, p1, width = self
        q0 = jnp.minimum(q0, 0.0)
        rise = q1 - q0
        secant = jnp.where(rise > 0, -q0 / jnp.where(rise > 0, rise, 1.0), 0.5)
        # A convex or concave function has its zero between the zeros of the secant and of a tangent.
        tangents = jnp.stack([-over(q0, p0 * width), 1.0 - over(q1, p1 * width)])
        guesses = jnp.stack([secant, *jnp.where((tangents > 0) & (tangents < 1), tangents, secant)])
        near, far = jnp.min(guesses, axis=0), jnp.max(guesses, axis=0)
        which = jnp.argmin(jnp.where(changes, near, jnp.inf))
        zero = jnp.where(count % 2 == 0, near[which] - short / width, far[which] + short / width)
        turn = jnp.min(jnp.where(bumps, over(p0, p0 - p1), jnp.inf))
        share = jnp.where(jnp.any(changes), zero, turn)
        least = jnp.minimum(short / width, 0.5)
        return jnp.clip(jnp.where((count % 5 == 4) | ~jnp.isfinite(share), 0.5, share), least, 1.0 - least)
