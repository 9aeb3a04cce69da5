"""Dry friction as a variable structure: sliding either way, sticking, or free (as in MSL `PartialFriction`).

The modes are -1 (sliding backward), 0 (stuck), 1 (sliding forward) and 2 (free, or not yet known). A path parameter s
gives all modes the same structure: it is the effort (torque or force) that holds the two sides together while stuck,
and their relative acceleration otherwise (Otter, Elmqvist, Mattsson, `Hybrid modeling in Modelica based on the
synchronous data flow principle`, CACSD 1999).

A stuck pair yields slightly, so that several stuck pairs which hold the same motion share its load and their efforts
are determined. It obeys a = creep s - v / LAG with the speed v, and so creeps at creep LAG s, which is negligible. All
decisions use the speed `slow`, well above the creep, because the sign of a number that is zero within rounding means
nothing: a pair sticks below `slow`, breaks away at no more than a few times `slow`, and counts as `moving`, so that it
can stick again, only above twice the sticking speed. Until then the integration error can exceed these speeds, so the
direction of the acceleration decides, and not the sign of the speed. The same rules apply if an event changes the speed
of a stuck or sliding pair.
"""

import functools as ft

import jax.numpy as jnp
from jax import Array

from acausal import Events, Scalar, when, yields

STUCK = 0.0
FREE = 2.0
MODES = {-1.0: "slides backward", STUCK: "sticks", 1.0: "slides forward", FREE: "free"}  # names in plots
CREEP = 1e-10  # in SI units
LAG = 1e-3  # s
REST = 1e-10  # relative speed that counts as rest, in SI units
NOISE = 1e4  # integration error of the speed, as a multiple of the sticking speed


def stuck(mode: Scalar) -> Array | bool:
    """Whether the two sides stick."""
    return mode == STUCK


def acceleration(mode: Scalar, s: Scalar, speed: Scalar, creep: Scalar) -> Scalar:
    """Relative acceleration."""
    return jnp.where(stuck(mode), creep * s - speed / LAG, s)


def along(mode: Scalar, speed: Scalar) -> Scalar:
    """Speed in the direction of sliding; unlike the absolute value, it is smooth through zero."""
    return jnp.where(mode == FREE, 0.0, mode * speed)


def effort(mode: Scalar, s: Scalar, level: Scalar) -> Scalar:
    """Friction effort; `level` is its absolute value while sliding."""
    return jnp.where(stuck(mode), s, jnp.where(mode == FREE, 0.0, mode * level))


def rubs(mode: Scalar) -> Array | bool:
    """Whether the pair slides with friction."""
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
    """Mode changes of a pair that stays stuck while low <= s <= high."""
    slow = rest + 4.0 * creep * LAG * jnp.maximum(jnp.abs(low), jnp.abs(high))
    is_moving, is_held = moving > 0.5, stuck(mode) & pressed
    # Twice the speed at which a pair sticks, and half the speed at which a stuck pair tears loose.
    is_slow = jnp.abs(speed) <= 2.0 * slow
    onward = dict(mode=jnp.sign(speed), moving=1.0)
    slows = rubs(mode) & (mode * speed < jnp.where(is_moving, slow, -slow))
    # A pair that has just broken away and accelerates onward moves backward only by integration error, unless an event
    # throws it back.
    turns = is_moving | (mode * s < 0.0)
    is_thrown = turns | (jnp.abs(speed) > NOISE * slow)
    return dict(
        engage=_when((mode == FREE) & pressed & ~is_slow, **onward),
        hold=_when((mode == FREE) & pressed & is_slow, mode=STUCK, moving=0.0),
        stick=_when(slows & turns & is_slow, mode=STUCK, moving=0.0),
        reverse=_when(slows & is_thrown & ~is_slow, **onward),
        _moves=_when(rubs(mode) & ~is_moving & (mode * speed > 2.0 * slow), moving=1.0),
        forward=when(is_held & (s > high), mode=1.0, moving=0.0),
        backward=when(is_held & (s < low), mode=-1.0, moving=0.0),
        _slips=yields(mode=jnp.where(stuck(mode), FREE, mode)),
        tear=_when(is_held & (jnp.abs(speed) > 4.0 * slow), **onward),
    )


_when = ft.partial(when, check_units=False)  # LAG has a unit


def lets_go(mode: Scalar, apart: Array | bool) -> Events:
    """The event that frees a pair when its sides are separated."""
    return dict(release=when((mode != FREE) & apart, mode=FREE))
