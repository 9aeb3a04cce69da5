"""Any solver, and after each of its steps what the model asks for: a return to the invariants, and events."""

from collections.abc import Callable
from typing import Any, NamedTuple

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array

from .._equinox_private import unvmap_any
from .._numbers import Numbers
from .._reduce.instants import first
from .conditions import EventConditions
from .controller import has_leapt
from .field import Given
from .interval import Point
from .look import TOO_SOON, Found, look
from .peaks import Peaks
from .record import Record
from .run_events import RunEvents
from .schedule import tick
from .settle import settle
from .span import Span, SpanOf
from .state_vector import StateVector, Vector

PAST = 1e-9  # events are looked for beyond the end by this share of a step, which may be meant to end at one
NEAR_END = 1e-6  # a bend so near to an end of a step, as a share of it, does no harm within the step
CROWD = 16  # events accumulate where more than so many, and two of each, are close together
INTERVAL = 1e-9  # share of the time span within which events are close together
ACCUMULATED = 4.0  # why a run ends, besides the reasons of `settle`


class Memory(eqx.Module):
    """What is carried from step to step."""

    inner: Any
    events: "EventMemory | None"


class EventMemory(NamedTuple):
    """Of the conditions, which hold and which have just become true, and their margins, if nothing has `jumped` since;
    when scheduled events are due; what happened so far, and how many in a row were close to the time `mark`.
    """

    holds: Any
    fresh: Array
    point: Point
    due: Any
    record: Record
    mark: Any
    crowd: Any
    jumped: Any


class _Event(NamedTuple):
    """The events that begin first in a step, at t, if there `is_any`, and a time just `before`; and where it should
    rather end, the `cut`, infinite if it is good as it is.
    """

    is_any: Array
    t: Array
    before: Array
    begins: Array
    holds: Array
    point: Point  # the margins at the end
    cut: Array


class Stepper(diffrax.AbstractAdaptiveSolver, diffrax.AbstractWrappedSolver):
    """Steps of `solver`, up to the first event.

    `project(t, states, given)` brings the states back onto the invariants, `remember(t, point, given)` renews the
    unknowns from which iterations start, `peaks` are those that are wanted, and `events` those of the run; each may be
    missing.

    A step is taken as if there were no events. Where one begins in it, the step ends there: the vector is that of the
    dense output, changed by what happens, and `moment` in its status says when. With times to save at beyond the event,
    or where an equation bends, the step does not count, and is repeated up to there.
    """

    solver: Any
    layout: StateVector = eqx.field(static=True)
    project: Callable[[Any, Any, Any], Any] | None = eqx.field(static=True)
    remember: Callable[[Any, Any, Any], Any] | None = eqx.field(static=True)
    peaks: Peaks | None = eqx.field(static=True)
    events: RunEvents | None = eqx.field(static=True)
    begin: Any  # the `EventMemory` to start with, None without events

    @property
    def term_structure(self) -> Any:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.solver.term_structure

    @property
    def term_compatible_contr_kwargs(self) -> Any:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.solver.term_compatible_contr_kwargs

    @property
    def root_finder(self) -> Any:
        return self.solver.root_finder

    @property
    def scan_kind(self) -> Any:
        return self.solver.scan_kind

    @property
    def interpolation_cls(self) -> Any:  # pyright: ignore[reportIncompatibleVariableOverride, reportIncompatibleMethodOverride]
        return SpanOf(self.solver.interpolation_cls, self.layout)

    def order(self, terms: Any) -> Any:
        return self.solver.order(terms)

    def error_order(self, terms: Any) -> int:
        return self.solver.error_order(terms)

    def init(self, terms: Any, t0: Numbers, t1: Any, y0: Vector, args: Given) -> Memory:
        inner = self.solver.init(terms, t0, t1, self.layout.core(y0), args.carrying(y0[self.layout.carried]))
        return Memory(inner, self.begin)

    def func(self, terms: Any, t0: Numbers, y0: Vector, args: Given) -> Vector:
        carried = y0[self.layout.carried]
        rates = self.solver.func(terms, t0, self.layout.core(y0), args.carrying(carried))
        return self.layout.joined(rates, jnp.zeros_like(carried))

    @eqx.filter_jit  # diffrax traces a step several times
    def step(
        self, terms: Any, t0: Any, t1: Any, y0: Vector, args: Given, solver_state: Memory, made_jump: Any
    ) -> tuple[Vector, Vector, dict[str, Any], Memory, diffrax.RESULTS]:
        layout, state = self.layout, solver_state.events
        carried = y0[layout.carried]
        end = t1 if state is None else _short_of(t1, y0[layout.next_instant], args)
        jumped = made_jump if state is None else made_jump | state.jumped
        core, error, info, inner, result = self.solver.step(
            terms, t0, end, layout.core(y0), args.carrying(carried), solver_state.inner, jumped
        )
        error = layout.joined(error, jnp.zeros_like(carried))
        inner_path = self.solver.interpolation_cls(t0=t0, t1=end, **info)
        path = Span(t0, end, inner_path, carried, y0[layout.memory], layout)
        if state is None:
            y = self._remembered(t1, self._projected(t1, layout.joined(core, carried), args), args)
            y = self._with_peaks(path, t1, y, args)
        else:
            assert self.events is not None
            sizes = self.events.system.nominals
            error = jnp.where(has_leapt(y0[layout.states], core[layout.states], sizes), jnp.inf, error)
            y, state = self._through_events(path, t0, t1, layout.joined(core, carried), state, args)
            y = self._with_peaks(path, y[layout.moment], y, args)
            # A run that has ended stays where it is.
            has_ended = y0[layout.outcome] != 0
            y, error = jnp.where(has_ended, y0, y), jnp.where(has_ended, 0.0, error)
        info = {"inner": info, "begin": t0, "end": end, "carried": carried, "memory": y[layout.memory]}
        return y, error, info, Memory(inner, state), result

    def _with_peaks(self, path: Span, end: Numbers, y: Vector, given: Given) -> Vector:
        """The vector after a step with the peaks up to its end."""
        if self.peaks is None:
            return y
        return self.layout.with_part(y, self.layout.peaks, self.peaks.renewed(path, end, y, given))

    def _projected(self, t: Array, y: Vector, given: Given) -> Vector:
        """The vector on the invariants."""
        if self.project is None:
            return y
        states = self.layout.states
        return self.layout.with_part(y, states, self.project(given.direction * t, y[states], given))

    def _remembered(self, t: Array, y: Vector, given: Given) -> Vector:
        """The vector with the unknowns that belong to it."""
        if self.remember is None:
            return y
        return self.layout.with_part(y, self.layout.memory, self.remember(given.direction * t, y, given))

    def _through_events(
        self, path: Span, t0: Array, t1: Array, y1: Vector, state: EventMemory, given: Given
    ) -> tuple[Vector, EventMemory]:
        """The vector at the end of a step or after the first events in it."""
        layout, events, forward = self.layout, self.events, given.direction
        assert events is not None
        found = self._first_event(*jax.lax.stop_gradient((path, t0, t1, y1[layout.next_instant], state, given)))
        moved, there = path.moving(found.t)
        t = jnp.where(found.is_any, moved, t1)
        y = self._projected(t, jnp.where(found.is_any, there, y1), given)
        idle = jnp.zeros(events.total, bool)
        memory = EventMemory(
            found.holds, idle, found.point, state.due, state.record, state.mark, state.crowd, jnp.asarray(False)
        )

        def happening() -> tuple[Vector, EventMemory]:
            # What is not due has no time, and reverse mode must not meet its infinity.
            due = jnp.where(jnp.isfinite(state.due), state.due, 0.0)
            settled = settle(
                events, forward * t, forward * found.before, y, found.begins, found.holds, due, state.record, given
            )
            y1 = events.with_algebraic(settled.t, settled.y, given)
            due = events.due(settled.t, y1, given)
            mark, crowd, outcome = _crowded(events, state, t - t0, settled.t, found.begins, given)
            outcome = jnp.where(settled.outcome != 0, settled.outcome, outcome)
            instant = forward * first(due, forward)
            y1 = layout.with_part(y1, layout.status, jnp.stack([outcome, forward * settled.t, found.cut, instant]))
            return y1, EventMemory(
                settled.holds, settled.fresh, found.point, due, settled.record, mark, crowd, found.is_any
            )

        def idling() -> tuple[Vector, EventMemory]:
            status = jnp.stack([y[layout.outcome], t, found.cut, y[layout.next_instant]])
            return layout.with_part(y, layout.status, status), memory

        y, memory = jax.lax.cond(unvmap_any(found.is_any), happening, idling)
        return self._remembered(t, y, given), memory

    def _first_event(
        self, path: Span, t0: Array, t1: Array, instant: Array, state: EventMemory, given: Given
    ) -> _Event:
        """Which events begin first in a step, and when; none where it has to be repeated up to there."""
        events, forward = self.events, given.direction
        assert events is not None
        numbers, due = given.numbers, forward * state.due
        run_end, short = forward * numbers.t1, tick(t1, numbers.t0)
        arrives = _is_there(t1, instant, given) & (instant < run_end)
        end = jnp.where(arrives, instant + short, jnp.minimum(t1 + PAST * (t1 - t0), run_end))
        none = jnp.zeros(events.total, bool)
        found = Found(jnp.asarray(False), end, t1, none, none, state.holds, state.point, end)
        if events.is_searched:
            span = jnp.abs(numbers.t1 - numbers.t0)
            margins = lambda t: events.margins(forward * t, path.evaluate(t), given)  # noqa: E731
            conditions = EventConditions(margins, events.conditions, events.reads, events.either, events.moves)
            start = state.point._replace(t=t0)
            found = look(conditions, start, ~state.jumped, end, state.holds, state.fresh, span, short)
        t = jnp.where(found.is_any, found.t, end)
        is_there = arrives & (instant <= t + short)
        # Beyond all that is due: equations have changed there.
        t = jnp.where(is_there, end, t)
        is_due = is_there & (due <= t)
        # A condition that leaps at a time known ahead becomes true by what happens there.
        begins = is_due | (found.begins & ~(found.leaps & is_there))
        before = jnp.minimum(jnp.where(found.is_any, found.before, t), jnp.where(is_there, t1 - 0.5 * short, t))
        cut = self._cut(found, t0, t1, given)
        is_whole = jnp.isinf(cut)
        return _Event(jnp.any(begins) & is_whole, t, before, begins & is_whole, found.holds, found.end, cut)

    def _cut(self, found: Found, t0: Numbers, t1: Array, given: Given) -> Array:
        """Where a step has to end so that an event lies at its end; infinite where it may lie within the step."""
        events, times = self.events, given.numbers.times
        assert events is not None
        is_cut = (
            jnp.any(found.begins & events.bends)
            & (found.t - t0 > NEAR_END * (t1 - t0))
            & (t1 - found.t > NEAR_END * (t1 - t0))
        )
        is_late = ~found.is_any & (found.reached < t1)
        if times is not None:
            saves = given.direction * times
            is_cut |= found.is_any & jnp.any((saves > found.t) & (saves <= t1))
        least = t0 + 4.0 * tick(t0, given.numbers.t0)
        to = jnp.maximum(jnp.where(is_late, found.reached, found.before), least)
        return jnp.where((is_cut | is_late) & (t1 > 2.0 * least - t0), to, jnp.inf)


def _is_there(t: Numbers, instant: Array, given: Given) -> Array:
    return instant <= t + tick(t, given.numbers.t0)


def _short_of(t1: Array, instant: Array, given: Given) -> Array:
    """The end of a step that leads to an instant, just before it: nothing has changed there yet."""
    return jnp.where(_is_there(t1, instant, given), t1 - 0.5 * tick(t1, given.numbers.t0), t1)


def _crowded(
    events: RunEvents, state: EventMemory, since: Array, t: Numbers, begins: Numbers, given: Given
) -> tuple[Array, Array, Array]:
    """Since when events have been close together, how many, and whether the run ends because they accumulate: many are
    close together, or one happens again at once. `since` is the time since the start of the step.
    """
    span, happens = jnp.abs(given.numbers.t1 - given.numbers.t0), jnp.any(begins & ~events.scheduled)
    is_close = jnp.abs(t - state.mark) < INTERVAL * span
    crowd = jnp.where(happens, jnp.where(is_close, state.crowd + 1, 0), state.crowd)
    mark = jnp.where(happens & ~is_close, jax.lax.stop_gradient(t), state.mark)
    again = jnp.any(begins & state.fresh & ~events.scheduled) & (since < TOO_SOON * span)
    return mark, crowd, jnp.where(again | (crowd > CROWD + 2 * events.total), ACCUMULATED, 0.0)
