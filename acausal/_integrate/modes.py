"""The modes at a start: together with the start values, since each decides on the other."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from .field import Given
from .settle import TOGETHER, assigned
from .starting import Start


class Modes(NamedTuple):
    """A point and the discrete variables there; the events that still happen, and those of them that are refused."""

    x: Any
    discrete: Any
    happen: Any
    refused: Any


class _Round(NamedTuple):
    x: Any
    y: Any
    holds: Any
    fired: Any
    truths: Any
    count: Any


def modes_at(
    start: Start, t0: Any, x: Any, root: Callable[[Any], Any], at: Callable[[Any, Given], tuple[Any, Given]]
) -> Modes:
    """The modes in which nothing happens at the point that they lead to, a constant.

    A complementarity problem at one instant: `root(discrete)` is the point that belongs to modes, `at` says which
    states and numbers of the run that is, and its events are those to be changed. First all of them are, later the
    first one only, which comes to an end as least-index methods for linear complementarity problems do (Murty, `Linear
    Complementarity, Linear and Nonlinear Programming`, 1988, ch. 4). What events set besides discrete variables does
    not happen here, but at the start of a run.
    """
    events, layout = start.events, start.events.layout
    given, t0, y, x = jax.lax.stop_gradient((start.given, t0, start.y, x))
    matters = events.acts & ~events.scheduled
    most = 4 * events.total + TOGETHER + 16

    def next_round(r: _Round) -> _Round:
        x = root(r.y[layout.discrete])
        states, found = at(x, given)
        y = layout.with_part(r.y, layout.states, states)
        here = events.here(t0, y, found)
        begun = here.truths & ~r.holds & matters
        fired = jnp.where(r.count < TOGETHER, begun, begun & (jnp.cumsum(begun) == 1))
        y, _ = assigned(events, y, here.values, fired)
        return _Round(x, y, here.truths & (r.holds | fired), fired, here.truths, r.count + 1)

    none = jnp.zeros(events.total, bool)
    begin = _Round(x, y, start.holds, ~none, none, jnp.asarray(0))
    end = jax.lax.while_loop(lambda r: jnp.any(r.fired) & (r.count < most), next_round, begin)
    before, after = start.discrete, end.y[layout.discrete]
    # What a past event has set may depend on parameters; what changed since are modes, which do not.
    discrete = jnp.where(after == before, before, after)
    return Modes(end.x, discrete, end.fired, end.truths & events.refused)
