"""How near to a bend of the equations a step may end."""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from .conditions import EventConditions, sign_of
from .interval import Seen

# The stages of a step lie off its path by up to 0.08 h² times the second derivative there, by the methods of this
# library. The two differences between a margin and its tangents at both ends are 1.0 of it together.
STAGES = 0.125
STEADY = 0.1  # a margin whose rate is less than this share of the mean one decays to zero, and does not pass it
LEAST = 0.002  # least share of a step by which it ends before a bend


class Bend(NamedTuple):
    """When equations bend next, infinite if not soon; and `room`, how long before it a step has to end that none of its
    stages lies beyond. What such a stage adds to values is small, but it has the slopes of the wrong side.
    """

    t: Array
    room: Array


def no_bend() -> Bend:
    """None comes."""
    return Bend(jnp.asarray(jnp.inf), jnp.asarray(0.0))


def next_bend(conditions: EventConditions, low: Seen, high: Seen, above: Array) -> Bend:
    """The bend that is next at the end of an interval, by rates there. At its end the relations `above` hold.

    Where steps are so long that no room would be enough, the bend has the least one. A margin that has not moved at all
    does not come: its rate is lost in the rounding of the numbers that it is a difference of.
    """
    sign, width = -sign_of(above), high.t - low.t
    q, rise, p0, p1 = sign * high.g, sign * (high.g - low.g), sign * low.rate, sign * high.rate
    comes = conditions.bends & (q <= 0) & (p1 > 0) & (p1 * width >= STEADY * rise) & (rise != 0)
    rate = jnp.where(comes, p1, 1.0)
    distance = jnp.where(comes, -q / rate, jnp.inf)
    room = STAGES * (jnp.abs(rise - p0 * width) + jnp.abs(rise - p1 * width)) / rate
    room = jnp.maximum(jnp.where(room < 0.5 * (width + distance), room, 0.0), LEAST * width)
    which = jnp.argmin(distance - room)
    return Bend(high.t + distance[which], room[which])
