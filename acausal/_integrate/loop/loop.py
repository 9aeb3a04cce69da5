"""The loop over the steps of a run, with the events at the end of each."""

import dataclasses
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._equinox_private import unvmap_any
from ..events.crossing import Found, Returns, first_crossing
from ..events.event_history import EventHistory
from ..events.event_time import Approach
from ..events.iteration import ACCUMULATED, STOPPED, Jumps, settle
from ..setup.state_vector import Vector
from ..step.correction import Correction, corrected, share
from ..step.rejected import rejectable
from ..step.span import Span
from .carry import Carry
from .loop_start import LoopStart
from .steps import Steps

EARLY = 1e-2  # fraction of a step: if a relation changes back within it, the step is too long


class StepLoop(Steps):
    """The time loop of a run."""

    def first(self, start: LoopStart) -> Carry:
        """The loop state before the first step, without recorded steps."""
        y = start.y
        step_args, core = self.args.carrying(y[self.layout.carried]), self.layout.core(y)
        dt0 = self.args.numbers.dt0
        control = self.sizes.init(self.terms, self.t0, self.t1, core, dt0, step_args, self.solver)
        first_end = self.planned(self.t0, self.allowed(control.wish, y), *self.limit(start.due))
        inner = None
        if not self.settings.is_corrected:
            inner = self.solver.init(self.terms, self.t0, first_end, core, step_args)
        none = jnp.asarray(0)
        return Carry(
            t=self.forward * start.t,
            y=y,
            truths=start.truths,
            armed=jnp.ones_like(start.truths),
            farthest=jnp.zeros(start.truths.shape),
            due=start.due,
            outcome=start.outcome,
            jumped=jnp.asarray(self.events is not None),
            end_sample=self.no_sample(y),
            returns=Returns.none(len(start.truths)),
            inner=inner,
            control=control,
            failed=jnp.asarray(False),
            n_steps=none,
            n_accepted=none,
            history=start.history,
            before=jnp.full(1 + self.layout.size if self.settings.keeps_steps else 0, jnp.inf),
            rows=self.no_rows(),
            record=None,
            meter=self.settings.progress.init(),
        )

    def goes_on(self, c: Carry) -> Array:
        """Whether the run continues."""
        most = self.args.numbers.most
        goes_on = (c.t < self.t1) & (c.outcome == 0) & ~c.failed
        return goes_on if most is None else goes_on & (c.n_steps < most)

    def steps(self, c: Carry) -> Carry:
        """Takes steps up to the end of the run, or as many as there is room for."""
        settings = self.settings
        c = c._replace(record=self.no_record(c))
        if settings.save == "chunk" and c.history is not None:
            c = c._replace(history=self.no_history())

        def has_room(c: Carry) -> Array:
            assert c.history is not None
            return jnp.asarray(c.history.n <= settings.max_events)

        def goes_on(c: Carry) -> Array:
            is_in_room = settings.save == "chunk" and c.history is not None
            return self.goes_on(c) & has_room(c) if is_in_room else self.goes_on(c)

        end = self.kind.loop(goes_on, self.body, c, max_steps=settings.max_steps, buffers=self.buffers)
        settings.progress.close(end.meter)
        return end

    def body(self, c: Carry) -> Carry:
        """Takes a step and handles the events at its end."""
        layout, args, events = self.layout, self.args, self.events
        t0, y0 = c.t, c.y
        carried = y0[layout.carried]
        step_args = args.carrying(carried)
        instant, is_before = self.limit(c.due)
        planned = self.planned(t0, self.allowed(c.control.wish, y0), instant, is_before)
        meets = is_before & (instant <= planned + args.tick(planned))
        # The step ends just before an instant, where nothing has changed yet, also if the run ends at that instant.
        is_end = ~is_before & (instant <= planned)
        early = instant - 0.5 * args.tick(instant)
        t1 = jnp.where(meets, early, planned - jax.lax.stop_gradient(jnp.where(is_end, planned - early, 0.0)))

        attempt = rejectable(self.attempt, self.settings) if self.kind.is_reversible else self.attempt
        core0 = layout.core(y0)
        where = (self.solver, t0, t1, c.jumped, c.inner)
        core1, error, (info, work, inner, solver_failed) = attempt(core0, step_args, where)
        held = jax.lax.stop_gradient
        correction = None if work is None else Correction(self.solver, held(work), step_args, self.settings)
        path_of_solver = self.solver.interpolation_cls(t0=t0, t1=t1, **info)
        path = Span(t0, t1, path_of_solver, carried, layout, correction)
        if self.histories is not None:
            carried, misfit = self.histories.completed(path)
            path = dataclasses.replace(path, carried=carried)
            error = self.sizes.with_misfit(core0, core1, error, misfit)
        keep, control, is_stuck = self.sizes.adapted(
            t0, t1, core0, core1, step_args, error, self.solver.error_order(self.terms), c.control
        )
        y1 = layout.joined(core1, carried)
        outcome = c.outcome
        if events is None:
            settled, at = c._replace(t=t1, y=self.remembered(t1, self.projected(t1, y1))), t1
            triggered, jumps = jnp.zeros(0, bool), Jumps.none(0)
        else:
            settled, found, is_early, is_missed, triggered, at, jumps = self.through_events(
                path, c, t1, y1, keep, meets, instant
            )
            # The step was too long to resolve the solution just after an event.
            keep &= ~is_early & ~is_missed
            outcome = jnp.where(is_missed, ACCUMULATED, outcome)
            control = control._replace(wish=jnp.where(is_early, 0.25 * held(t1 - t0), control.wish))
            if np.any(events.nonlinear):
                keep &= ~jnp.any(jnp.isfinite(found))
                c = c._replace(due=jnp.where(jnp.isfinite(found), found, c.due))
        t, y = settled.t, settled.y
        if self.peaks is not None:
            new = self.peaks.renewed(path, t, y, step_args)
            y = layout.with_part(y, layout.peaks, new)
        settled = self.with_histories(settled._replace(y=y), triggered, at, jumps)
        y = settled.y
        rows = self.saved(path, c, t, keep)
        record = self.recorded(c, settled, y, keep, {"inner": info, "start": t0, "end": t1, "carried": carried})
        # A step that an event cuts short is no reason for a longer step.
        wish = jnp.where(keep & (held(t) < t1), jnp.minimum(control.wish, c.control.wish), control.wish)
        control = control._replace(wish=wish)
        chosen = settled._replace(y=y, inner=inner, control=control, history=None, rows=None, record=None, meter=None)
        old = c._replace(control=control, outcome=outcome, history=None, rows=None, record=None, meter=None)
        new = jax.tree.map(lambda a, b: jnp.where(keep, a, b), chosen, old)
        meter = self.settings.progress.step(c.meter, (new.t - self.t0) / (self.t1 - self.t0))
        return new._replace(
            control=control,
            failed=is_stuck & ~keep | solver_failed & is_stuck,
            n_steps=c.n_steps + 1,
            n_accepted=c.n_accepted + keep,
            history=self.noted(c.history, settled.history, keep),
            rows=rows,
            record=record,
            meter=meter,
        )

    def through_events(
        self, path: Span, c: Carry, t1: Array, y1: Vector, keep: Array, meets: Array, instant: Array
    ) -> tuple[Carry, Array, Array, Array, Array, Array, Jumps]:
        """The loop state after the first events in a step, or else at its end. Also the times located in the step at
        which equations change, up to the first of which the step must be repeated; whether a relation that has just
        changed changes back immediately, so that the step must be shorter; whether an event is missed (see `Returns`);
        the triggered events, their time, and the jumps of recorded signals.
        """
        events, args, forward = self.events, self.args, self.forward
        assert events is not None
        held = jax.lax.stop_gradient
        end, short = held(t1), args.tick(held(t1))
        if events.is_searched:
            assert c.end_sample is not None
            held_path, held_args, last, returns = held((path, args, c.end_sample._replace(t=c.t), c.returns))
            conditions = events.conditions(held_path, end, c.armed, held_args)
            found = first_crossing(conditions, last, ~c.jumped, c.truths, returns, end, short, keep)
        else:
            no, none = jnp.asarray(False), jnp.zeros(events.total, bool)
            found = Found(
                is_any=no, t=end, before=end, triggered=none, rates=jnp.zeros(events.total), truths=c.truths, shift=(),
                end=c.end_sample, reached=end, returns=c.returns, is_missed=no,
            )  # fmt: skip
        is_partial = ~found.is_any & (found.reached < end)
        stop = jnp.where(found.is_any, found.t, jnp.where(is_partial, found.reached, end))
        instant = held(instant)
        is_there = meets & (instant <= stop + 2.0 * short)
        # Just after all due times, where the equations have changed.
        t = jnp.where(is_there, instant + args.tick(instant), stop)
        is_due = is_there & (forward * c.due <= t)
        # A break that returns together with another event takes its time, so that rounding errors do not add up.
        own = jnp.min(jnp.where(is_due & ~events.remembers, forward * c.due, jnp.inf))
        at = jnp.where(is_there, jnp.where(jnp.isfinite(own), own, instant), stop)
        new = jnp.where(found.triggered & events.nonlinear & ~is_due, forward * stop, forward * jnp.inf)
        triggered = (is_due | found.triggered) & keep
        changes_back = jnp.any((found.truths != c.truths) & ~c.armed & events.of_laws)
        is_early = keep & found.is_any & changes_back & (found.t - c.t < EARLY * (end - c.t))
        is_any = jnp.any(triggered)
        is_cut = is_any | is_partial
        before = jnp.where(found.is_any, found.before, jnp.where(is_there, instant - 0.5 * short, t))
        time, there = path.moving_point(t)
        rate_correction = None
        if events.is_searched and path.correction is not None:
            early = path.moving_point(before)
            theta = share(*held((path.inner, before)))
            there = corrected(path.correction, path.inner, there, found.shift[0], theta, *early)
            rate_correction = _rate_correction(*held((path, t, found.shift[1])))
        y = self.projected(jnp.where(is_cut, time, t1), jnp.where(is_cut, there, y1))
        t = jnp.where(is_cut, time, t1)

        approach = Approach(forward * before, forward * found.rates, rate_correction)
        changed, jumps = self.happened(c._replace(t=t, y=y, truths=found.truths), approach, triggered, c.truths)
        remains = changed.truths == found.truths
        # The rates of unresolved fast transients change their signs on the path, also without an event.
        is_turned = jnp.any((changed.y != y)[events.determines_rates])
        returns = Returns(
            arrival=jnp.where(remains & is_turned & ~events.of_laws, found.returns.arrival, 0.0),
            depth=jnp.where(remains, found.returns.depth, jnp.inf),
        )
        # A run that stops at an instant ends just after it, so that a run that continues it does not repeat its events.
        behind = jnp.where(is_there & (changed.outcome == STOPPED), args.tick(changed.t), 0.0)
        t = changed.t + behind
        t = jnp.where(~is_cut & (self.t1 - t <= 2.0 * args.tick(self.t1)), self.t1, t)
        # The equations may also change at the end of the run, after which no search follows.
        y = self.remembered(t, changed.y, anew=is_any | (t >= self.t1))
        armed, farthest = c.armed & (changed.truths == c.truths), c.farthest
        if events.is_searched:
            assert found.end is not None
            far = jnp.abs(found.end.g)
            armed |= ~is_any & (far > args.back)
            farthest = jnp.maximum(farthest, far)
        carried = changed._replace(
            t=t, y=y, armed=armed, farthest=farthest, jumped=is_cut, end_sample=found.end, returns=returns
        )
        return carried, new, is_early, found.is_missed, triggered, held(at), jumps

    def happened(self, c: Carry, approach: Approach, triggered: Array, earlier: Array) -> tuple[Carry, Jumps]:
        """The loop state after an instant, with the events that begin there and all events that they trigger, and the
        jumps of recorded signals. `earlier` are the truths of the relations before it.
        """
        events, args, forward = self.events, self.args, self.forward
        assert events is not None
        log = EventHistory.empty(events.room, events.n_model)

        def settled() -> tuple[dict[str, Any], Jumps]:
            # Events that are not scheduled have infinite times, which reverse mode must not see.
            due = jnp.where(jnp.isfinite(c.due), c.due, 0.0)
            holds = events.circuit.hold(c.truths)
            end = settle(
                *(events, forward * c.t, approach, c.y, triggered, c.truths, holds, due, log, args),
                earlier=earlier,
                n_before=len(c.before),
            )
            y = events.with_algebraic(end.t, end.y, args, anew=True)
            return dict(
                t=forward * end.t,
                y=y,
                truths=end.truths,
                due=events.due(end.t, y, args),
                history=end.history,
                before=end.before,
                outcome=end.outcome,
            ), end.jumps

        def idle() -> tuple[dict[str, Any], Jumps]:
            return dict(
                t=c.t,
                y=c.y,
                truths=c.truths,
                due=c.due,
                history=log,
                before=jnp.full(len(c.before), jnp.inf),
                outcome=c.outcome,
            ), Jumps.none(len(events.histories))

        changes, jumps = jax.lax.cond(unvmap_any(jnp.any(triggered)), settled, idle)
        return c._replace(**changes), jumps


def _rate_correction(path: Span, t: Array, shift_rate: Array) -> Callable[[Array], Array]:
    """Correction of the rates at the first event (see `Approach`)."""
    assert path.correction is not None
    _, slope = jax.jvp(path.plain, (t,), (jnp.ones_like(t),))
    return jax.tree_util.Partial(Correction.rate_correction, path.correction, slope[path.layout.states] + shift_rate)
