"""Conditions of events, from the relations between numbers that they are made of."""

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

from .._numbers import Numbers

if TYPE_CHECKING:
    from .interval import Seen


def sign_of(above: Array) -> Array:
    return jnp.where(above, 1.0, -1.0)


def signs(g: Array, above: Array) -> Array:
    """Which relations hold, by their margins g; where a margin is zero, what held before, `above`, still does."""
    return (g > 0) | (above & ~(g < 0))


class EventConditions(NamedTuple):
    """The conditions of the events of a run, along a step.

    - `seen(t)`: how far each relation is from its limit, positive where it holds, and how that changes.
    - `logic(holds, fails)`: bounds of the margins of conditions, from those of relations and of their negatives.
    - `reads`: [events, relations], which relations decide on which condition.
    - `either`: events that happen when their condition becomes false, too.
    - `moves`: the margins that change with time.
    - `bends`: the margins at whose zeros equations bend.
    - `gentle`: those at whose zeros equations do not jump.
    - `mates`: [margins, ...], those that may be the same but for the sign, itself among them.
    """

    seen: Callable[[Numbers], "Seen"]
    logic: Callable[[Array, Array], Array]
    reads: np.ndarray
    either: np.ndarray
    moves: np.ndarray
    bends: np.ndarray
    gentle: np.ndarray
    mates: np.ndarray

    def begun(self, true: Array, holds: Array) -> Array:
        """Which events begin where these conditions hold, after `holds`."""
        return (~holds & true) | (self.either & holds & ~true)

    def may_begin(self, may_end: Array, may_hold: Array, times: Array, holds: Array) -> Array:
        """Which events may begin on an interval on which some conditions may end, and some may hold.

        `times` is how often each relation may change: a condition that holds must become false and true again to begin.
        """
        many = jnp.sum(self.reads * times, axis=1) > 1
        return jnp.where(holds, may_end & (self.either | many), may_hold)
