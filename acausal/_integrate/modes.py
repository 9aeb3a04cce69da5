"""The modes at a start: together with the start values, since each decides on the other."""

import functools as ft
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from .._evaluate.events import EventSet
from .._reduce.jaxpr import slice_output
from .field import Given
from .run_events import RunEvents
from .settle import TOGETHER, assigned, repeated
from .starting import Start


class Modes(NamedTuple):
    """A point and the discrete variables there; the events that make one another happen, where that has no end; and
    those that are refused.
    """

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
    late: Any  # what happened one by one
    count: Any


class Solver(NamedTuple):
    """`root(discrete)` is the point that belongs to modes, a constant; `followed(x, discrete)` is the same as the
    function of all numbers that it is; `at` says which states and numbers of the run that is.
    """

    root: Callable[[Any], Any]
    followed: Callable[[Any, Any], Any]
    at: Callable[[Any, Given], tuple[Any, Given]]


def modes_at(start: Start, t0: Any, x: Any, solver: Solver) -> Modes:
    """The modes in which nothing happens at the point that they lead to.

    A complementarity problem at one instant: the events at the point that belongs to modes are those to be changed.
    First all of them are, later the first one only, which comes to an end as least-index methods for linear
    complementarity problems do (Murty, `Linear Complementarity, Linear and Nonlinear Programming`, 1988, ch. 4). What
    events set besides discrete variables does not happen here, but at the start of a run.

    Modes are constants. Where events set discrete variables to values that depend on numbers, such as what is measured
    at the time, all rounds are differentiated.
    """
    events, layout = start.events, start.events.layout
    is_smooth = events.system.events is not None and sets_values(events.system.events)
    given, y = (start.given, start.y) if is_smooth else jax.lax.stop_gradient((start.given, start.y))
    t0, x = jax.lax.stop_gradient((t0, x)) if not is_smooth else (t0, jax.lax.stop_gradient(x))
    matters = events.acts & ~events.scheduled
    most = 4 * events.total + TOGETHER + 16

    def next_round(r: _Round) -> _Round:
        discrete = r.y[layout.discrete]
        x = solver.root(discrete)
        states, found = solver.at(solver.followed(x, discrete) if is_smooth else x, given)
        y = layout.with_part(r.y, layout.states, states)
        here = events.here(t0, y, found)
        begun = here.truths & ~r.holds & matters
        fired = jnp.where(r.count < TOGETHER, begun, begun & (jnp.cumsum(begun) == 1))
        y, _ = assigned(events, y, here.values, fired)
        late = r.late | (fired & (r.count >= TOGETHER))
        return _Round(x, y, here.truths & (r.holds | fired), fired, here.truths, late, r.count + 1)

    none = jnp.zeros(events.total, bool)
    begin = _Round(x, y, start.holds, ~none, none, none, jnp.asarray(0))
    end = repeated(lambda r: jnp.any(r.fired), next_round, begin, most, is_smooth)
    if is_smooth:
        return _modes(events, end, end.y[layout.discrete])
    before, after = start.discrete, end.y[layout.discrete]
    # What a past event has set may depend on parameters; what changed since are modes, which do not.
    return _modes(events, end, jnp.where(after == before, before, after))


def _modes(events: RunEvents, end: _Round, discrete: Any) -> Modes:
    return Modes(end.x, discrete, end.late & jnp.any(end.fired), end.truths & events.refused)


@ft.lru_cache(maxsize=64)
def sets_values(events: EventSet) -> bool:
    """Whether events that are not scheduled set variables to what has derivatives, not to one of some numbers."""
    actions = events.actions
    avals = actions.closed.in_avals
    shapes = [jax.ShapeDtypeStruct(aval.shape, aval.dtype) for aval in avals]

    def along(values: list[Any], tangents: list[Any]) -> list[Any]:
        return jax.jvp(lambda *values: actions(values), values, tangents)[1]

    closed = jax.make_jaxpr(along)(shapes, shapes)
    # Tangents that vanish identically are zeros that read nothing.
    moves = [max(slice_output(closed, i).used, default=-1) >= len(avals) for i in range(len(closed.jaxpr.outvars))]
    kinds = [entry.kind for entry in events.entries for _ in entry.targets]
    return any(is_moving and kind != "at" for is_moving, kind in zip(moves, kinds, strict=True))
