"""Modes and start values of a run, found together because each determines the other."""

import functools as ft
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import PyTree

from ..._evaluate.system import System
from ..._numbers import Numbers
from ..._reduce.event_indicators import edges
from ..._reduce.jaxpr import slice_output
from ..._tracing import traced_once
from ..events.changes import with_discrete, with_follows
from ..events.rounds import TOGETHER, first_of, most_rounds, ready, repeated
from ..events.run_events import RunEvents
from ..loop.loop_start import EventStart
from ..setup.field import RunArgs
from .search import is_met


class StartModes(NamedTuple):
    """A point and its discrete variables, with masks of events: those that trigger each other without end, those that
    are refused, and those that have fired because their condition is true.
    """

    x: PyTree
    discrete: Array
    happen: Array
    refused: Array
    holds: Array


class _Point(NamedTuple):
    x: PyTree
    y: Array
    holds: Array
    truths: Array
    values: list[Array]  # values that events would set
    lack: Array  # residual of each condition of the search


class _Round(NamedTuple):
    """State of the mode iteration. `y` and `holds` are examined next; `kept` is the best point so far."""

    y: Array
    holds: Array
    kept: _Point
    fired: Numbers
    late: Array  # events that fired one by one, after the first rounds
    due: Array  # events that the last round has scheduled for the start, or for an earlier instant
    count: Any
    tried: Array  # number of the single event on trial; 0 while events fire by themselves


class Solver(NamedTuple):
    """The functions that find the point for given modes.

    - `root(discrete)`: the point and the residuals of the conditions, without derivatives.
    - `followed(x, discrete)`: the same point, differentiable with respect to the numbers of the run.
    - `at(x, args)`: the states at a point, and the numbers of the run with the parameters found there.
    """

    root: Callable[[Array], tuple[PyTree, Array]]
    followed: Callable[[PyTree, Array], PyTree]
    at: Callable[[PyTree, RunArgs], tuple[Array, RunArgs]]


def modes_at(start: EventStart, t0: Numbers, solver: Solver) -> StartModes:
    """Consistent modes: no event fires at the point that they imply.

    This is a complementarity problem at one instant: events that fire at the point of the current modes change them.
    The first rounds fire all of these events, later rounds only the first one, which terminates as least-index methods
    for linear complementarity problems do (Murty, `Linear Complementarity, Linear and Nonlinear Programming`, 1988,
    ch. 4). Events that a round schedules for the start fire in the next round. Events change only discrete variables
    here; other variables are set at the start of a run.

    If the modes found have no point that satisfies the conditions, single events are tried in turn. An example is a
    body pushed to a distant stop, which has no equilibrium before the stop. An event is kept if no event whose
    condition is then true, fired before or not, changes a mode, and the squared residual is less than half.

    Modes are constants. If events set discrete variables to values that depend on numbers, such as a measured value,
    all rounds are differentiated.
    """
    events, layout = start.events, start.events.layout
    is_smooth = sets_values(events.system)
    args, y = (start.args, start.y) if is_smooth else jax.lax.stop_gradient((start.args, start.y))
    t0 = t0 if is_smooth else jax.lax.stop_gradient(t0)
    matters = events.responds
    none = jnp.zeros(events.total, bool)
    most, single = most_rounds(events), np.eye(events.total, dtype=bool)[matters & ~events.follows]

    def found(y: Array, holds: Array) -> tuple[_Point, Array]:
        """The point for the modes in y, and the events that fire there."""
        discrete = y[layout.discrete]
        x, lack = solver.root(discrete)
        states, own = solver.at(solver.followed(x, discrete) if is_smooth else x, args)
        y = layout.with_part(y, layout.states, states)
        here = events.here(t0, y, own)
        truths = events.circuit.hold(events.truths_at_start(t0, here.indicators, args))
        triggered = with_follows(events, edges(truths, holds, events.either), y, here.values) & matters
        return _Point(x, y, holds, truths, here.values, lack), triggered

    def lasts(point: _Point) -> Numbers:
        changes = jnp.where(events.either, point.truths != point.holds, point.truths) | events.follows
        after = with_discrete(events, point.y, point.values, changes & matters)
        return jnp.all(after[layout.discrete] == point.y[layout.discrete])

    def due(before: Array, after: Array) -> Array:
        """Events that a round has scheduled for the start or earlier, if they set discrete variables only."""
        if not events.resets_times:
            return none
        is_reset, last = events.set_anew(t0, before, after, args)
        return is_reset & jnp.isfinite(last) & ~events.sets_others

    def next_round(r: _Round) -> _Round:
        new, triggered = point(r.y, r.holds)
        is_trial = r.tried > 0
        is_better = lasts(new) & ~jnp.any(new.truths & events.refused) & (_size(new) < 0.5 * _size(r.kept))
        kept = jax.tree.map(lambda a, b: jnp.where(is_trial & ~is_better, b, a), new, r.kept)
        fired = (
            jnp.where(r.count < TOGETHER, ready(events, triggered), first_of(events, triggered)) | r.due
        ) & ~is_trial
        late = r.late | (fired & (r.count >= TOGETHER))
        tries = ~jnp.any(fired) & (len(single) > 0)
        number = jnp.where(is_trial & is_better, 0, r.tried)
        tried = jnp.asarray(single)[jnp.minimum(number, len(single) - 1)] if len(single) else fired
        y = with_discrete(events, kept.y, kept.values, jnp.where(tries, tried, fired))
        holds = jnp.where(events.either, jnp.where(fired, kept.truths, kept.holds), kept.truths & (kept.holds | fired))
        return _Round(y, holds, kept, fired, late, due(kept.y, y) & ~tries, r.count + 1, number + tries)

    def goes_on(r: _Round) -> Array:
        tries = ~is_met(r.kept.lack) & (r.tried > 0) & (r.tried <= len(single))
        return jnp.where(jnp.any(r.fired), r.count < most, tries & (not is_smooth))

    point, shapes = traced_once(found, y, start.holds)
    empty = jax.tree.map(lambda a: jnp.zeros(a.shape, a.dtype), shapes[0])
    first = _Round(y, start.holds, empty, ~none, none, none, jnp.asarray(0), jnp.asarray(0))
    trials = 0 if is_smooth else len(single) * (len(single) + 1)
    end = repeated(goes_on, next_round, first, most + trials, is_smooth)
    if is_smooth:
        return _modes(events, end, end.kept.y[layout.discrete])
    before, after = start.discrete, end.kept.y[layout.discrete]
    # A discrete variable set by a past event may depend on parameters and keeps its derivatives. One that has changed
    # since then is a mode, which is constant.
    return _modes(events, end, jnp.where(after == before, before, after))


def _size(point: _Point) -> Array:
    """The sum of squared residuals of all conditions."""
    return jnp.sum(point.lack**2)


def _modes(events: RunEvents, end: _Round, discrete: Array) -> StartModes:
    truths = end.kept.truths
    happen, holds = end.late & jnp.any(end.fired), truths & events.responds & ~events.held
    return StartModes(end.kept.x, discrete, happen, truths & events.refused, holds[: events.n_model])


@ft.lru_cache(maxsize=64)
def sets_values(system: System) -> bool:
    """Whether events without known times set discrete variables to differentiable values, rather than to constants."""
    if system.events is None:
        return False
    actions, entries = system.events.actions, system.events.entries
    avals = actions.closed.in_avals
    shapes = [jax.ShapeDtypeStruct(aval.shape, aval.dtype) for aval in avals]

    def along(values: list[Array], tangents: list[Array]) -> list[Array]:
        return jax.jvp(lambda *values: actions(values), values, tangents)[1]

    closed = jax.make_jaxpr(along)(shapes, shapes)
    # An output without derivatives has a tangent that reads no tangent of an input.
    moves = [max(slice_output(closed, i).used, default=-1) >= len(avals) for i in range(len(closed.jaxpr.outvars))]
    places = system.carried.discrete_places
    counts = [
        entry.kind not in ("at", "sample", "started", "yields") and leaf in places
        for entry in entries
        for leaf in entry.targets
    ]
    return any(is_moving and is_own for is_moving, is_own in zip(moves, counts, strict=True))
