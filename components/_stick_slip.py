"""Dry friction as a variable structure: sliding either way, sticking, or free (as in MSL `PartialFriction`).

The modes are -1 (sliding backward), 0 (stuck), 1 (sliding forward) and 2 (free, or not known yet). One structure serves
all of them by a path parameter s: while stuck it is the effort (torque or force) that keeps the two sides together, and
else their relative acceleration (Otter, Elmqvist, Mattsson, `Hybrid modeling in Modelica based on the synchronous data
flow principle`, CACSD 1999).

A stuck pair gives way a little, so that the efforts are determined also where several stuck pairs hold one and the same
motion: they share it. With the speed v it obeys a = creep s - v / LAG, and so creeps with creep LAG s, too slow to
matter. All decisions are made by speeds well above that one, `slow`, and none by a number that is zero but for
rounding: a pair sticks below `slow`, breaks away with no more than a few times that speed, and counts as `moving`, so
that it can stick again, only above twice the speed at which it sticks. Until then a step may err by more than those
speeds, so that the direction in which the pair is accelerated decides, and not the sign of its speed. What an event
does to the speed of a stuck or a sliding pair is seen by the same rules.
"""

import jax.numpy as jnp
from jax import Array

from acausal import Events, Scalar, when

STUCK = 0.0
FREE = 2.0
CREEP = 1e-10  # in SI units
LAG = 1e-3  # s
REST = 1e-10  # relative speed that counts as rest, in SI units
NOISE = 1e4  # errors of a run in the speed, over that at which a pair sticks


def stuck(mode: Scalar) -> Array | bool:
    """Whether both sides stick to each other."""
    return mode == STUCK


def acceleration(mode: Scalar, s: Scalar, speed: Scalar, creep: Scalar) -> Scalar:
    """The relative acceleration."""
    return jnp.where(stuck(mode), creep * s - speed / LAG, s)


def along(mode: Scalar, speed: Scalar) -> Scalar:
    """The speed in the direction of sliding; it goes on smoothly through zero, unlike its size."""
    return jnp.where(mode == FREE, 0.0, mode * speed)


def effort(mode: Scalar, s: Scalar, level: Scalar) -> Scalar:
    """The friction, where `level` is its size while sliding."""
    return jnp.where(stuck(mode), s, jnp.where(mode == FREE, 0.0, mode * level))


def rubs(mode: Scalar) -> Array | bool:
    """Whether it slides with friction."""
    return (mode == 1.0) | (mode == -1.0)


def changes(
    mode: Scalar,
    moving: Scalar,
    speed: Scalar,
    s: Scalar,
    *,
    low: Scalar,
    high: Scalar,
    rest: Scalar,
    creep: Scalar,
    pressed: Array | bool = True,
) -> Events:
    """All changes between the modes of a pair that holds still while low <= s <= high."""
    slow = rest + 4.0 * creep * LAG * jnp.maximum(jnp.abs(low), jnp.abs(high))
    is_moving, is_held = moving > 0.5, stuck(mode) & pressed
    # Twice as fast as when it sticks, and half as fast as when what sticks is torn loose.
    is_slow = jnp.abs(speed) <= 2.0 * slow
    onward = dict(mode=jnp.sign(speed), moving=1.0)
    slows = rubs(mode) & (mode * speed < jnp.where(is_moving, slow, -slow))
    # What has just broken away and is accelerated onward goes backward by errors of the run, unless it is thrown back.
    turns = is_moving | (mode * s < 0.0)
    is_thrown = turns | (jnp.abs(speed) > NOISE * slow)
    return dict(
        engage=when((mode == FREE) & pressed & ~is_slow, **onward),
        hold=when((mode == FREE) & pressed & is_slow, mode=STUCK, moving=0.0),
        stick=when(slows & turns & is_slow, mode=STUCK, moving=0.0),
        reverse=when(slows & is_thrown & ~is_slow, **onward),
        _moves=when(rubs(mode) & ~is_moving & (mode * speed > 2.0 * slow), moving=1.0),
        forward=when(is_held & (s > high), mode=1.0, moving=0.0),
        backward=when(is_held & (s < low), mode=-1.0, moving=0.0),
        tear=when(is_held & (jnp.abs(speed) > 4.0 * slow), **onward),
    )


def lets_go(mode: Scalar, apart: Array | bool) -> Events:
    """A pair that is taken apart is free."""
    return dict(release=when((mode != FREE) & apart, mode=FREE))
