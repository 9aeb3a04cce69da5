"""Rigid contacts as a variable structure: open, or closed.

The modes are -1 (resting at the lower stop), 0 (free) and 1 (resting at the upper stop). A path parameter s gives all
modes the same structure: it is the contact effort into the component at rest, and the acceleration otherwise. A resting
body loses its speed within a few LAG and is drawn to the stop (Baumgarte 1972), so that a search for a state of rest
finds its position; in a run, it is already there within rounding. The draw is weak: it must accelerate the body less
than the creep of dry friction that sticks at the same position under load.

An impact is an `acausal.impact`: the engine finds the impulses of all contacts that are struck or closed.

The speed, acceleration and contact effort of an unloaded body at a stop are zero within rounding, so their signs must
not trigger events. With `slow`, the largest rebound speed that comes to rest, an impact requires a speed above 1e-6
`slow`. A slower body comes to rest if the contact would push it then, by an acceleration above `PRESS` times the one
that reaches `slow` within LAG. A body pressed less than that reaches the speed of an impact before it has moved
noticeably.
"""

import jax.numpy as jnp

from acausal import Events, Scalar, impact, when, yields

LOW, FREE, HIGH = -1.0, 0.0, 1.0
MODES = {LOW: "at the lower stop", FREE: "free", HIGH: "at the upper stop"}  # names in plots
LAG = 1e-3  # s
DRAW = 10.0  # 1/s2, acceleration towards the stop per distance from it
PRESS = 1e-9
NOISE = 1e-6  # largest speed of a closed contact that rounding and the draw cause, in SI units


def acceleration(
    mode: Scalar, s: Scalar, creep: Scalar, *, place: Scalar, speed: Scalar, low: Scalar, high: Scalar
) -> Scalar:
    """Acceleration of a body with the given position and speed between stops at `low` and `high`."""
    beyond = jnp.where(mode > 0.0, place - high, jnp.where(mode < 0.0, place - low, 0.0))
    return jnp.where(mode == FREE, s, creep * s - speed / LAG - DRAW * beyond)


def effort(mode: Scalar, s: Scalar, push: Scalar) -> Scalar:
    """Contact effort: while the body is free, only the force `push` of an impact."""
    return jnp.where(mode == FREE, push, s)


def stop(
    side: float,
    mode: Scalar,
    beyond: Scalar,
    speed: Scalar,
    acceleration: Scalar,
    s: Scalar,
    *,
    e: Scalar,
    slow: Scalar,
    push: str,
    mode_name: str = "mode",
) -> Events:
    """Events of the lower stop (`side` -1) or of the upper one (1), which the body has passed by `beyond`: impact,
    coming to rest, and lift-off. `push` names the force of the impact, positive away from the stop.
    """
    approach, free = side * speed, mode == FREE
    stays = e * jnp.abs(approach) <= slow
    would_push = side * s + DRAW * jnp.maximum(beyond, 0.0) + jnp.minimum(approach, 0.0) / LAG > PRESS * slow / LAG
    is_apart = (side * s < 0.0) | (-approach > jnp.maximum(slow, NOISE))
    return dict(
        impact=impact(
            free & (beyond > 0.0) & (approach > 1e-6 * slow),
            force=push,
            speed=-approach,
            acceleration=-side * acceleration,
            after=jnp.where(stays | ~free, 0.0, e * jnp.abs(approach)),
            closed=mode == side,
            **{mode_name: jnp.where(stays, side, FREE)},
        ),
        # The path parameter s is an effort or an acceleration.
        rest=when(
            free & (beyond >= 0.0) & (jnp.abs(approach) <= 1e-6 * slow) & would_push,
            check_units=False,
            **{mode_name: side},
        ),
        lift=when((mode == side) & is_apart, **{mode_name: FREE}),
    )


def stops(
    mode: Scalar,
    place: Scalar,
    speed: Scalar,
    acceleration: Scalar,
    s: Scalar,
    low: Scalar,
    high: Scalar,
    *,
    e: Scalar,
    slow: Scalar,
    mode_name: str = "mode",
) -> Events:
    """Events of both stops, with the forces `push_low` and `push_high`."""
    found: Events = {"_yields": yields(**{mode_name: FREE})}
    for name, side, beyond in (("low", LOW, low - place), ("high", HIGH, place - high)):
        own = stop(side, mode, beyond, speed, acceleration, s, e=e, slow=slow, push=f"push_{name}", mode_name=mode_name)
        found |= {f"{event}_{name}": stated for event, stated in own.items()}
    return found
