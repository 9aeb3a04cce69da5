"""Any solver, and after each of its steps what the model asks for: a return to the invariants, and events."""

from collections.abc import Callable
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._equinox_private import unvmap_any
from .._numbers import Numbers, Truth
from .._reduce.instants import first
from .controller import has_leapt
from .course import Course, on_course
from .event_state import EventState, crowded
from .field import Given
from .first_event import first_event, short_of
from .found import Found
from .moment import Approach
from .peaks import Peaks
from .rejected import Outcome, rejectable
from .run_events import RunEvents
from .settings import Settings
from .settle import settle
from .span import Span, SpanOf
from .state_vector import StateVector, Vector
from .wrapper import Wrapper


class SolverState(eqx.Module):
    """What the solver keeps from step to step: that of the solver within, and that of the events."""

    inner: Any
    events: EventState | None


class Stepper(Wrapper):
    """Steps of `solver`, up to the first event.

    `project(t, y, given)` returns the states on the invariants, `remember(t, point, given, anew)` renews the unknowns
    from which iterations start, `peaks` are those that are wanted, and `events` those of the run; each may be missing.
    Steps of a run that `is_reversible` may fail and be differentiated in reverse mode.

    A step is taken as if there were no events. Where one begins in it, the step ends there: the vector is that of the
    dense output, changed by what happens, and `moment` in its status says when. With times to save at beyond the event,
    or where an equation bends, the step does not count, and is repeated up to there.
    """

    settings: Settings = eqx.field(static=True)
    project: Callable[[Array, Array, Given], Array] | None = eqx.field(static=True)
    remember: Callable[[Array, Array, Given, Truth], Array] | None = eqx.field(static=True)
    peaks: Peaks | None = eqx.field(static=True)
    events: RunEvents | None = eqx.field(static=True)
    is_reversible: bool = eqx.field(static=True)
    begin: EventState | None  # the `EventState` to start with, None without events

    @property
    def layout(self) -> StateVector:
        return self.settings.layout

    @property
    def interpolation_cls(self) -> Any:  # pyright: ignore[reportIncompatibleVariableOverride, reportIncompatibleMethodOverride]
        return SpanOf(self.solver.interpolation_cls, self.layout)

    @property
    def _of_core(self) -> Any:
        """The solver within; one that iterates takes the tolerances of the core, not those of the whole vector."""
        solver = self.solver
        if not isinstance(solver, diffrax.AbstractImplicitSolver):
            return solver
        atol = solver.root_finder.atol  # pyright: ignore[reportAttributeAccessIssue]
        if np.shape(atol) != (self.layout.size,):
            return solver
        return eqx.tree_at(lambda s: s.root_finder.atol, solver, self.layout.core(atol))

    def init(self, terms: Any, t0: Any, t1: Any, y0: Vector, args: Given) -> SolverState:
        inner = self.solver.init(terms, t0, t1, self.layout.core(y0), args.carrying(y0[self.layout.carried]))
        return SolverState(inner, self.begin)

    def func(self, terms: Any, t0: Numbers, y0: Vector, args: Given) -> Vector:
        carried = y0[self.layout.carried]
        rates = self.solver.func(terms, t0, self.layout.core(y0), args.carrying(carried))
        return self.layout.joined(rates, jnp.zeros_like(carried))

    @eqx.filter_jit  # diffrax traces a step several times
    def step(
        self, terms: Any, t0: Any, t1: Any, y0: Vector, args: Given, solver_state: SolverState, made_jump: Numbers
    ) -> Outcome:
        attempt = rejectable(Stepper._attempt, self.settings) if self.is_reversible else Stepper._attempt
        y, error, info, state, result = attempt(self, terms, t0, t1, y0, args, solver_state, made_jump)
        if state.events is not None:
            # A run that has ended stays where it is.
            has_ended = y0[self.layout.outcome] != 0
            y, error = jnp.where(has_ended, y0, y), jnp.where(has_ended, 0.0, error)
        return y, error, info, state, result

    def _attempt(
        self, terms: Any, t0: Any, t1: Any, y0: Vector, args: Given, solver_state: SolverState, made_jump: Numbers
    ) -> Outcome:
        """A step of a run that goes on."""
        layout, state = self.layout, solver_state.events
        carried = y0[layout.carried]
        end = t1 if state is None else short_of(t1, y0[layout.next_instant], args)
        jumped = made_jump if state is None else made_jump | state.jumped
        given, course = args.carrying(carried), None
        if self.settings.follows_course:
            core, error, info, work = self.solver.step_to_look_into(terms, t0, end, layout.core(y0), given)
            inner, result = None, diffrax.RESULTS.successful
            course = Course(self.solver, jax.lax.stop_gradient(work), given, self.settings)
        else:
            core, error, info, inner, result = self._of_core.step(
                terms, t0, end, layout.core(y0), given, solver_state.inner, jumped
            )
        error = layout.joined(error, jnp.zeros_like(carried))
        inner_path = self.solver.interpolation_cls(t0=t0, t1=end, **info)
        path = Span(t0, end, inner_path, carried, layout, course)
        if state is None:
            y = self._remembered(t1, self._projected(t1, layout.joined(core, carried), args), args)
            y = self._with_peaks(path, t1, y, args)
        else:
            assert self.events is not None
            sizes = self.events.system.nominals
            error = jnp.where(has_leapt(y0[layout.states], core[layout.states], sizes), jnp.inf, error)
            y, state = self._through_events(path, t0, t1, layout.joined(core, carried), state, args)
            y = self._with_peaks(path, y[layout.moment], y, args)
        info = {"inner": info, "begin": t0, "end": end, "carried": carried}
        if self.settings.save == "times":
            info["course"] = course
        return y, error, info, SolverState(inner, state), result

    def _with_peaks(self, path: Span, end: Numbers, y: Vector, given: Given) -> Vector:
        """The vector after a step with the peaks up to its end."""
        if self.peaks is None:
            return y
        return self.layout.with_part(y, self.layout.peaks, self.peaks.renewed(path, end, y, given))

    def _projected(self, t: Array, y: Vector, given: Given) -> Vector:
        """The vector on the invariants."""
        if self.project is None:
            return y
        return self.layout.with_part(y, self.layout.states, self.project(given.direction * t, y, given))

    def _remembered(self, t: Array, y: Vector, given: Given, *, anew: Truth = False) -> Vector:
        """The vector with the unknowns that belong to it."""
        if self.remember is None:
            return y
        return self.layout.with_part(y, self.layout.memory, self.remember(given.direction * t, y, given, anew))

    def _through_events(
        self, path: Span, t0: Array, t1: Array, y1: Vector, state: EventState, given: Given
    ) -> tuple[Vector, EventState]:
        """The vector at the end of a step or after the first events in it."""
        layout, events, forward = self.layout, self.events, given.direction
        assert events is not None
        found, cut = first_event(events, *jax.lax.stop_gradient((path, t0, t1, y1[layout.next_instant], state, given)))
        moved, there = path.moving(found.t)
        lag = back = None
        if events.is_searched:
            before = path.moving(found.before)
            if np.any(events.bends):
                back = before[1] - there
            if path.course is not None:
                there = on_course(path.course, path.inner, there, found.shift[0], found.before, *before)
                lag = _lag(*jax.lax.stop_gradient((path, found)))
        t = jnp.where(found.is_any, moved, t1)
        y = self._projected(t, jnp.where(found.is_any, there, y1), given)
        idle = jnp.zeros(events.total, bool)
        unchanged = EventState(
            found.holds, idle, found.left, found.end, found.band, state.due, state.history, state.mark, state.crowd,
            jnp.asarray(False),
        )  # fmt: skip

        def happening() -> tuple[Vector, EventState]:
            # What is not due has no time, and reverse mode must not meet its infinity.
            due = jnp.where(jnp.isfinite(state.due), state.due, 0.0)
            approach = Approach(forward * found.before, found.pace, found.sides, found.zero, lag, back)
            settled = settle(events, forward * t, approach, y, found.begins, found.holds, due, state.history, given)
            y1 = events.with_algebraic(settled.t, settled.y, given, anew=True)
            due = events.due(settled.t, y1, given)
            mark, crowd, outcome = crowded(events, state, t - t0, settled.t, found.begins, given)
            outcome = jnp.where(settled.outcome != 0, settled.outcome, outcome)
            instant = forward * first(due, forward)
            y1 = layout.with_part(y1, layout.status, jnp.stack([outcome, forward * settled.t, cut, instant]))
            return y1, EventState(
                settled.holds, settled.fresh, settled.zero, found.end, found.band.without(settled.change), due,
                settled.history, mark, crowd, found.is_any,
            )  # fmt: skip

        def idling() -> tuple[Vector, EventState]:
            status = jnp.stack([y[layout.outcome], t, cut, y[layout.next_instant]])
            return layout.with_part(y, layout.status, status), unchanged

        y, state = jax.lax.cond(unvmap_any(found.is_any), happening, idling)
        # The equations may have changed at the end of the run, too, beyond which nothing is looked for.
        is_last = t >= forward * given.numbers.t1
        return self._remembered(t, y, given, anew=found.is_any | is_last), state


def _lag(path: Span, found: Found) -> Callable[[Array], Array]:
    """What rates miss at the first event: see `Approach`."""
    assert path.course is not None
    _, pace = jax.jvp(path.plain, (found.t,), (jnp.ones_like(found.t),))
    return jax.tree_util.Partial(Course.lag, path.course, pace[path.layout.states] + found.shift[1])
