"""Rigid stops as a variable structure: free, or resting at the lower or upper one.

The modes are -1 (resting at the lower stop), 0 (free) and 1 (resting at the upper stop). A path parameter s gives all
modes the same structure: it is the contact effort into the component at rest, and the acceleration otherwise. A resting
body loses its speed within a few LAG and is drawn to the stop (Baumgarte 1972), so that a search for a state of rest
finds its position; in a run, it is already there within rounding. The draw is weak: it must accelerate the body less
than the creep of dry friction that sticks at the same position under load.

The speed, acceleration and contact effort of an unloaded body at a stop are zero within rounding, so their signs must
not trigger events. With `slow`, the largest rebound speed that comes to rest, an impact requires a speed above 1e-6
`slow`, and pressing on the stop requires an acceleration above `PRESS` times the one that reaches `slow` within LAG. A
body pressed less than that reaches the speed of an impact before it has moved noticeably.
"""

from typing import Any

import jax.numpy as jnp

from acausal import Events, Scalar, when

MODES = {-1.0: "at the lower stop", 0.0: "free", 1.0: "at the upper stop"}  # names in plots
LAG = 1e-3  # s
DRAW = 10.0  # 1/s2, acceleration towards the stop per distance from it
PRESS = 1e-9


def acceleration(
    mode: Scalar, s: Scalar, creep: Scalar, *, place: Scalar, speed: Scalar, low: Scalar, high: Scalar
) -> Scalar:
    """Acceleration of a body with the given position and speed between stops at `low` and `high`."""
    beyond = jnp.where(mode > 0.0, place - high, jnp.where(mode < 0.0, place - low, 0.0))
    return jnp.where(mode == 0.0, s, creep * s - speed / LAG - DRAW * beyond)


def effort(mode: Scalar, s: Scalar) -> Scalar:
    """Contact effort, zero while the body is free."""
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
    """Events: impact at both stops, which changes the speed `name`, coming to rest there, and lift-off."""
    rebound = -e * speed
    stays = jnp.abs(rebound) <= slow
    free = mode == 0.0

    def impact(beyond: Any, side: float) -> Any:
        changes = {mode_name: jnp.where(stays, side, 0.0), name: jnp.where(stays, 0.0, rebound)}
        return when(free & beyond & (side * speed > 1e-6 * slow), **changes)

    def rests(beyond: Scalar, side: float) -> Any:
        """A slow body comes to rest if it is pressed against a stop or has penetrated it."""
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
