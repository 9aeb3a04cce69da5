"""Dry friction as a variable structure: sliding either way, sticking, or free (as in MSL `PartialFriction`).

The modes are -1 (sliding backward), 0 (stuck), 1 (sliding forward) and 2 (free, or not known yet). One structure serves
all of them by a path parameter s: while stuck it is the effort (torque or force) that keeps the two sides together, and
else their relative acceleration (Otter, Elmqvist, Mattsson, `Hybrid modeling in Modelica based on the synchronous data
flow principle`, CACSD 1999). A stuck pair creeps with the acceleration `creep` s, so that the efforts are determined
also where several stuck pairs hold one and the same motion: they share it.
"""

from typing import Any

import jax.numpy as jnp

from acausal import Events, Scalar, when

STUCK = 0.0
FREE = 2.0
CREEP = 1e-10  # relative acceleration per effort of a stuck pair, in SI units
REST = 1e-10  # relative speed that counts as rest, in SI units
# Break-away this much above the static level: the pair then surely accelerates, whatever the rounding.
ABOVE = 1.0 + 1e-10


def stuck(mode: Scalar) -> Any:
    return mode == STUCK


def acceleration(mode: Scalar, s: Scalar, creep: Scalar) -> Scalar:
    """The relative acceleration."""
    return jnp.where(stuck(mode), creep * s, s)


def effort(mode: Scalar, s: Scalar, level: Scalar) -> Scalar:
    """The friction, where `level` is its size while sliding."""
    return jnp.where(stuck(mode), s, jnp.where(mode == FREE, 0.0, mode * level))


def rubs(mode: Scalar) -> Any:
    """Whether it slides with friction."""
    return (mode == 1.0) | (mode == -1.0)


def begins(mode: Scalar, speed: Scalar, rest: Scalar, pressed: Any = True) -> Events:
    """What a free pair does when pressed together: it goes on sliding as it moves, or sticks."""
    direction = jnp.where(jnp.abs(speed) <= rest, STUCK, jnp.sign(speed))
    return dict(engage=when((mode == FREE) & pressed, mode=direction))


def sticks(mode: Scalar, speed: Scalar, rate: Scalar, rest: Scalar) -> Events:
    """A sliding pair sticks when it comes to rest, but not when it sets out from there."""
    slows = (mode * speed < rest) & (mode * rate < 0.0)
    return dict(stick=when(rubs(mode) & slows, mode=STUCK))


def breaks_away(mode: Scalar, s: Scalar, peak: Scalar) -> Events:
    """A stuck pair slides when it would have to hold more than the static level `peak`."""
    return dict(
        forward=when(stuck(mode) & (s > ABOVE * peak), mode=1.0),
        backward=when(stuck(mode) & (s < -ABOVE * peak), mode=-1.0),
    )


def lets_go(mode: Scalar, apart: Any) -> Events:
    """A pair that is taken apart is free."""
    return dict(release=when((mode != FREE) & apart, mode=FREE))
