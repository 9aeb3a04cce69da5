"""Rigid stops as a variable structure: free, or resting at the lower or upper one.

The modes are -1 (resting at the lower stop), 0 (free) and 1 (at the upper one). One structure serves all of them by a
path parameter s: while resting it is the contact effort into the component, else the acceleration. What rests loses its
speed within a few LAG, and is drawn to the stop itself, so that a search for a state of rest finds its place (Baumgarte
1972). In a run it is there already, but for an error of rounding. This must not accelerate it by as much as friction
that sticks at the same place creeps under its load, and so it is drawn weakly.

What lies at a stop unloaded has a speed, an acceleration and a contact effort that are zero but for rounding, and no
event follows from their signs: an impact needs a speed above 1e-6 of the largest one that comes to rest, and to be
pressed on needs an acceleration above `PRESS` of the one that gathers this largest speed within LAG. What is pressed
less gathers the former before it gets anywhere.
"""

from typing import Any

import jax.numpy as jnp

from acausal import Events, Scalar, when

LAG = 1e-3  # s
DRAW = 10.0  # 1/s2, acceleration towards the stop over the distance from it
PRESS = 1e-9


def acceleration(
    mode: Scalar, s: Scalar, creep: Scalar, *, place: Scalar, speed: Scalar, low: Scalar, high: Scalar
) -> Scalar:
    """The acceleration; `place` and `speed` are those of what the stops at `low` and `high` hold."""
    beyond = jnp.where(mode > 0.0, place - high, jnp.where(mode < 0.0, place - low, 0.0))
    return jnp.where(mode == 0.0, s, creep * s - speed / LAG - DRAW * beyond)


def effort(mode: Scalar, s: Scalar) -> Scalar:
    """The contact effort, zero while it is free."""
    return jnp.where(mode == 0.0, 0.0, s)


def stops(
    mode: Scalar,
    place: Scalar,
    speed: Scalar,
    s: Scalar,
    low: Scalar,
    high: Scalar,
    *,
    e: Scalar,
    slow: Scalar,
    name: str,
    mode_name: str = "mode",
) -> Events:
    """Impacts at both ends, which change the speed `name`, rest there, and lift-off from them."""
    rebound = -e * speed
    stays = jnp.abs(rebound) <= slow
    free = mode == 0.0

    def impact(beyond: Any, side: float) -> Any:
        changes = {mode_name: jnp.where(stays, side, 0.0), name: jnp.where(stays, 0.0, rebound)}
        return when(free & beyond & (side * speed > 1e-6 * slow), **changes)

    def rests(beyond: Scalar, side: float) -> Any:
        """A body that is pressed against a stop without a speed rests there, and one that is within the stop."""
        presses = (beyond >= 0.0) & (side * s > PRESS * slow / LAG) | (beyond > slow * LAG)
        return when(free & (jnp.abs(speed) <= slow) & presses, **{mode_name: side, name: 0.0})

    return dict(
        impact_low=impact(place < low, -1.0),
        impact_high=impact(place > high, 1.0),
        rest_low=rests(low - place, -1.0),
        rest_high=rests(place - high, 1.0),
        lift_low=when((mode == -1.0) & (s > 0.0), **{mode_name: 0.0}),
        lift_high=when((mode == 1.0) & (s < 0.0), **{mode_name: 0.0}),
    )
