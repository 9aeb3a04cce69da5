"""Discrete variables that follow values in the rounds of an event iteration."""

import jax.numpy as jnp
import numpy as np
from jax import Array

from .run_events import RunEvents


def with_follows(events: RunEvents, triggered: Array, y: Array, values: list[Array]) -> Array:
    """The events of a round: those `triggered`, and each `follow` whose `values` differ from its variables in y.

    Conditions of `ifelse` change first, because values that depend on them are not final before.
    """
    if not np.any(events.follows):
        return triggered
    return triggered | (_differ(events, y, values) & ~jnp.any(triggered & events.held))


def _differ(events: RunEvents, y: Array, values: list[Array]) -> Array:
    """For each event, whether it is a `follow` with a value that differs."""
    number, element, is_own = events.writes
    turns, places = np.nonzero(is_own & events.follows[number])
    numbers, elements = number[turns, places], element[turns, places]
    own = np.unique(numbers)
    rows = [np.flatnonzero(numbers == n) for n in own]
    # One row for each event, with its elements repeated up to the length of the longest.
    table = np.array([np.resize(row, max(map(len, rows))) for row in rows])
    new, old = jnp.concatenate(values)[elements[table]], y[events.layout.discrete][places[table]]
    differs = jnp.any((new != old) & ~jnp.isnan(new), axis=1)
    positions = np.zeros(events.total, int)
    positions[own] = 1 + np.arange(len(own))
    return jnp.concatenate([jnp.zeros(1, bool), differs])[positions]
