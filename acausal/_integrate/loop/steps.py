"""A step of a run: its end, its dense output, the first event in it, and the saved data."""

import dataclasses
import functools as ft
from collections.abc import Callable
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import PyTree

from ..._equinox_private import while_loop, written
from ..._evaluate.invariants import onto_invariants
from ..._numbers import Truth
from ..._reduce.angles import with_angles
from ..._reduce.jaxpr_instants import first
from ..events.event_history import EventHistory
from ..events.iteration import FULL, Jumps
from ..events.run_events import RunEvents
from ..setup.field import RunArgs, vector_field
from ..setup.pattern import jacobian_pattern
from ..setup.settings import Settings
from ..setup.state_vector import Vector
from ..solvers import AbstractRosenbrock
from ..step.adjoint import LoopKind
from ..step.controller import StepSizes, step_sizes
from ..step.interval import PathSample
from ..step.span import Span
from .carry import Carry, Rows, StepRecord
from .histories import Histories
from .peaks import Peaks


class Steps:
    """The operations of a step, for given numbers of a run."""

    def __init__(self, settings: Settings, args: RunArgs, events: RunEvents | None, kind: LoopKind) -> None:
        self.settings, self.layout, self.system = settings, settings.layout, settings.system
        self.args, self.events, self.kind = args, events, kind
        self.peaks = Peaks(settings) if settings.peaks else None
        self.histories = Histories(events, args) if events and np.any(events.remembers) else None
        self.forward = args.forward
        self.t0, self.t1 = self.forward * args.numbers.t0, self.forward * args.numbers.t1
        self.sizes = step_sizes(settings, args)
        self.solver = _method(settings, self.sizes, kind)
        field = vector_field(settings)
        self.terms = diffrax.ODETerm(lambda t, y, args: args.forward * field(args.forward * t, y, args))

    def attempt(self, core: Array, args: RunArgs, where: tuple[Any, Array, Array, Array, Any]) -> Any:
        """The end of a step, its error and its other results; `where` holds the solver and its inputs other than the
        core. All numbers are arguments, because derivatives are taken with respect to arguments.
        """
        solver, t0, t1, jumped, inner = where
        if self.settings.is_corrected:
            core, error, info, work = solver.step_to_look_into(self.terms, t0, t1, core, args)
            return core, error, (info, work, None, jnp.asarray(False))
        core, error, info, inner, result = solver.step(self.terms, t0, t1, core, args, inner, jumped)
        failed = result != diffrax.RESULTS.successful
        return core, jnp.where(failed, jnp.inf, error), (info, None, inner, jnp.asarray(failed))

    def projected(self, t: Array, y: Vector) -> Vector:
        """Projects the vector onto the invariants."""
        if not self.system.ordered.invariants:
            return y
        new = onto_invariants(self.system, self.forward * t, y[self.layout.point], self.args.inputs)
        return self.layout.with_part(y, self.layout.states, new)

    def remembered(self, t: Array, y: Vector, *, anew: Truth = False) -> Vector:
        """The vector with the tearing variables at this point, the warm start of later iterations."""
        memory = self.layout.memory
        if not self.system.carried.memory:
            return y
        new = self.system.with_memory(self.forward * t, y[self.layout.point], self.args.inputs, anew=anew)
        return self.layout.with_part(y, memory, new[memory])

    def limit(self, due: Array) -> tuple[Array, Array]:
        """The next time event, and whether it is before the end of the run."""
        if self.events is None:
            return jnp.asarray(jnp.inf), jnp.asarray(False)
        instant = self.forward * first(due, self.forward)
        return instant, instant < self.t1 - self.args.tick(self.t1)

    def planned(self, t: Array, wish: Array, instant: Array, is_before: Array) -> Array:
        """The end of a step of size `wish`, limited by the next time event and by the end of the run."""
        end = jnp.minimum(self.t1, jnp.where(is_before, instant, jnp.inf))
        # Avoid a tiny step after this one.
        return jnp.where(t + wish > end - 100.0 * self.args.tick(end), end, t + wish)

    def allowed(self, wish: Array, y: Vector) -> Array:
        """A step size limited by the shortest delay."""
        return wish if self.histories is None else jnp.minimum(wish, self.histories.longest_step(y))

    def with_histories(self, c: Carry, triggered: Array, at: Array, jumps: Jumps) -> Carry:
        """The loop state after a step with the histories at its end, and the times at which their breaks return. The
        events at the end of the step have the time `at`, just before that of the state, and signals have these `jumps`.
        """
        events, histories = self.events, self.histories
        if events is None or histories is None:
            return c
        order = histories.order(c.t, c.y, triggered, jumps.height, self.solver.order(self.terms))
        y = histories.begun(c.t + jax.lax.stop_gradient(at - c.t), c.y, order, jumps.leads)
        due = events.due(self.forward * c.t, y, self.args)
        is_full = jnp.any(histories.are_full(c.t, y)) & (c.outcome == 0) & (c.t < self.t1)
        outcome = jnp.where(is_full, FULL, c.outcome)
        return c._replace(y=y, due=jnp.where(events.remembers, due, c.due), outcome=outcome)

    def no_sample(self, y: Vector) -> PathSample | None:
        """Placeholder for the event indicators, which are unknown before the first step."""
        events = self.events
        if events is None or not events.is_searched:
            return None
        read = events.indicators_and_rates if self.settings.is_corrected else events.indicators
        here = jax.eval_shape(with_angles(lambda t: read(t, y, self.args)), jnp.asarray(0.0))
        here = jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), here)
        g, shift = (here.value[0], (here.value[1],) * 2) if self.settings.is_corrected else (here.value, ())
        return PathSample(jnp.asarray(0.0), g, g, here.angles, here.angles, here.steps, shift)

    # Saved data

    def noted(self, history: EventHistory | None, instant: EventHistory | None, keep: Array) -> EventHistory | None:
        """The history with the events of one more step."""
        if history is None or instant is None:
            return history
        kept = jax.tree.map(lambda a, b: jnp.where(keep, a, b), instant, EventHistory.empty(*instant.happened.shape))
        return history.followed_by(kept, self._inner_loop)

    def no_history(self) -> EventHistory | None:
        """An empty history with room for `max_events` moments, and for those of one more instant."""
        events = self.events
        return None if events is None else EventHistory.empty(self.settings.max_events + events.room, events.n_model)

    @property
    def _inner_loop(self) -> Callable[..., PyTree]:
        """A loop within a step."""
        return ft.partial(while_loop, kind="bounded" if self.kind.is_reversible else "lax")

    def saved(self, path: Span, c: Carry, t: Array, keep: Array) -> Rows | None:
        """The rows of requested times after a step along a path, which ends at t."""
        times = self.args.numbers.times
        if times is None:
            return None
        ordered = self.forward * times

        def is_passed(rows: Rows) -> Array:
            i = jnp.minimum(rows.n, len(times) - 1)
            return keep & (rows.n < len(times)) & (ordered[i] <= t)

        def save(rows: Rows) -> Rows:
            at = ordered[jnp.minimum(rows.n, len(times) - 1)]
            y = path.evaluate(at)
            true = jnp.asarray(True)
            return Rows(written(rows.ts, at, rows.n, true), written(rows.ys, y, rows.n, true), rows.n + 1)

        return self._inner_loop(is_passed, save, c.rows, max_steps=len(times), buffers=lambda rows: (rows.ts, rows.ys))

    def no_rows(self) -> Rows | None:
        """Empty rows at the start of a run."""
        times = self.args.numbers.times
        if times is None:
            return None
        return Rows(jnp.full(len(times), jnp.inf), jnp.full((len(times), self.layout.size), jnp.inf), jnp.asarray(0))

    def recorded(self, c: Carry, settled: Carry, y: Vector, keep: Array, info: PyTree) -> StepRecord | None:
        """The record after a step to the loop state `settled`, with the vector y there and dense output data `info`."""
        record = c.record
        if record is None:
            return None
        rows = [(record.moments, self.forward * settled.before[0]), (record.befores, settled.before[1:])]
        if record.infos is not None:
            values, structure = jax.tree.flatten(info)
            rows += zip(structure.flatten_up_to(record.infos), values, strict=True)
        moments, befores, *infos = (written(buffer, value, record.n, keep) for buffer, value in rows)
        ts, ys = written(record.ts, settled.t, record.n + 1, keep), written(record.ys, y, record.n + 1, keep)
        infos = None if record.infos is None else jax.tree.structure(info).unflatten(infos)
        return StepRecord(ts, ys, moments, befores, infos, record.n + keep)

    def no_record(self, c: Carry) -> StepRecord | None:
        """An empty record."""
        if not self.settings.keeps_steps:
            return None
        n, y = self.settings.max_steps, c.y

        def empty(n: int, *row: Any) -> Any:
            return jax.tree.map(lambda x: jnp.full((n, *x.shape), jnp.inf, x.dtype), row)

        ts, ys, (moments, befores) = empty(n + 1, c.t)[0], empty(n + 1, y)[0], empty(n, c.t, y)
        infos = None
        if self.settings.save != "steps":
            carried, core = y[self.layout.carried], self.layout.core(y)
            if isinstance(self.solver, AbstractRosenbrock):
                inner = self.solver.no_step(core)
            else:
                where = (self.solver, c.t, c.t, c.jumped, c.inner)
                inner = eqx.filter_eval_shape(lambda: self.attempt(core, self.args.carrying(carried), where)[2][0])
            (infos,) = empty(n, {"inner": inner, "start": c.t, "end": c.t, "carried": carried})
        return StepRecord(ts.at[0].set(c.t), ys.at[0].set(y), moments, befores, infos, jnp.asarray(0))

    def buffers(self, c: Carry) -> PyTree:
        """The arrays that the loop fills row by row."""
        # Absent parts are not read from the carry, which may be a tree with other leaves in their place.
        found: list[PyTree] = []
        if self.args.numbers.times is not None:
            found += [c.rows.ts, c.rows.ys]  # pyright: ignore[reportOptionalMemberAccess]
        if self.events is not None:
            found += [c.history.times, c.history.happened]  # pyright: ignore[reportOptionalMemberAccess]
        if self.settings.keeps_steps:
            names = ["ts", "ys", "moments", "befores", *(["infos"] if self.settings.save != "steps" else [])]
            found += [getattr(c.record, name) for name in names]
        return found


def _method(settings: Settings, sizes: StepSizes, kind: LoopKind) -> Any:
    """The solver, configured for the model, the tolerances and the differentiation mode."""
    system, solver = settings.system, settings.solver
    if isinstance(solver, AbstractRosenbrock):
        mass = None if system.mass is None else np.concatenate([system.mass, np.ones(settings.n_extra)])
        solver = dataclasses.replace(solver, n_integrals=settings.n_extra, pattern=jacobian_pattern(settings))
        return solver if mass is None else dataclasses.replace(solver, mass=mass)
    if isinstance(solver, diffrax.AbstractImplicitSolver):
        finder: Any = solver.root_finder
        for name in ("rtol", "atol", "norm"):
            value = getattr(finder, name)
            if not callable(value) and not isinstance(value, float | int | jax.Array | np.ndarray):
                # Not given: use the value of the step size controller.
                finder = eqx.tree_at(lambda f, name=name: getattr(f, name), finder, getattr(sizes.pid, name))
        solver = eqx.tree_at(lambda s: s.root_finder, solver, finder)
    if isinstance(solver, diffrax.AbstractRungeKutta) and solver.scan_kind is None:
        # Steps are differentiated in forward mode, which the solver's default loop over its stages does not allow.
        solver = dataclasses.replace(solver, scan_kind="bounded" if kind.is_reversible else "lax")
    return solver
