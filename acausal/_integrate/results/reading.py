"""Dense output: state vectors of a run at any time, from its recorded steps."""

import dataclasses
import functools as ft
from collections.abc import Callable
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._evaluate.starts import Inputs
from ..._evaluate.system import System
from ..._numbers import Numbers
from ..._tracing import are_traced
from ..loop.carry import StepRecord
from ..programs.program_digest import digest_of
from ..programs.stored_program import result_of
from ..setup.schedule import tick
from ..setup.state_vector import StateVector, Vector
from ..solvers._rosenbrock import AbstractRosenbrock, RosenbrockInterpolation
from ..step.correction import share, within
from ..step.interval import EVALUATIONS
from ..step.span import Span

AT_ONCE = 64  # steps evaluated together, which limits the memory for matrices
STEPS, SHARES = 128, 16  # steps, and places in each step, in one evaluation of known points


def within_run(t: Numbers, record: StepRecord) -> tuple[Array, Array]:
    """Times moved onto the ends of the run that they equal within the time resolution, and a mask of those outside the
    run. Times count forwards.
    """
    start, end = record.ts[0], record.ts[record.n]
    slack = tick(end, start)
    nearest = jnp.where(t < start, start, jnp.where(t > end, end, t))  # unlike clip, with all of the slope at the ends
    return nearest, ~((t >= start - slack) & (t <= end + slack))


@dataclasses.dataclass(frozen=True)
class Reading:
    """Dense output of the runs of a model, the same as the runs use internally. Time counts forwards, even in a run
    backwards in time.
    """

    system: System
    solver: diffrax.AbstractSolver
    layout: StateVector

    def at(self, t: Numbers, record: StepRecord, inputs: Inputs, forward: Any) -> Any:
        """State vectors at times [times]; NaN at times that the run did not reach."""
        xp = jnp if are_traced(t, record, inputs) else np
        if xp is np:
            t, record = jax.tree.map(np.asarray, (t, record))
        ts, n = record.ts, len(record.moments)
        i = xp.clip(xp.searchsorted(ts, t) - 1, 0, n - 1)
        end = ts[i + 1]
        is_there = (t >= ts[0]) & (i < record.n) & (t <= end)
        start = xp.where(is_there, record.infos["start"][i], t)  # missing rows are infinite
        theta = (t - start) / xp.where(is_there & (end > start), end - start, 1.0)
        ys = self.within(i, theta[:, None], record, inputs, forward)[1][:, 0]
        is_start = (t == ts[0]) & ~is_there
        return xp.where(is_there[:, None], ys, xp.where(is_start[:, None], record.ys[0], xp.nan))

    def within(self, i: Any, theta: Any, record: StepRecord, inputs: Inputs, forward: Any) -> tuple[Any, Any]:
        """Times and state vectors at fractions [steps, shares] of some steps."""
        steps = record.infos, record.ts[1:]
        if are_traced(i, theta, steps, inputs) or not len(i):
            return self((jax.tree.map(lambda x: x[i], steps), theta, inputs, forward))
        i, theta, steps = jax.tree.map(np.asarray, (i, theta, steps))
        blocks, more = [], SHARES - theta.shape[1]
        shares = np.pad(theta, ((0, 0), (0, more)), mode="edge")
        for first in range(0, len(i), STEPS):
            rows = np.minimum(np.arange(first, first + STEPS), len(i) - 1)
            arguments = jax.tree.map(lambda x: x[i[rows]], steps), shares[rows]  # noqa: B023
            blocks.append([np.asarray(x)[:, : theta.shape[1]] for x in result_of(self, (*arguments, inputs, forward))])
        ts, ys = (np.concatenate(parts)[: len(i)] for parts in zip(*blocks, strict=True))
        return ts, ys

    @ft.partial(jax.jit, static_argnums=0)
    def __call__(self, arguments: tuple[Any, Array, Inputs, Array]) -> tuple[Any, Any]:
        (infos, ends), theta, inputs, forward = arguments

        def of_step(step: tuple[Any, Array, Array]) -> tuple[Any, Any]:
            info, end, theta = step
            path = self.solver.interpolation_cls(t0=info["start"], t1=info["end"], **info["inner"])
            span = Span(path.t0, path.t1, path, info["carried"], self.layout)
            t = jnp.asarray(span.t0 + theta * (end - span.t0))
            return t, jax.vmap(self.on(span, inputs, forward))(t)

        return jax.lax.map(of_step, (infos, ends, theta), batch_size=AT_ONCE)

    def on(self, span: Span, inputs: Inputs, forward: Array) -> Callable[[Array], Vector]:
        """The state vector as a function of time in a step, with stiff states corrected by the equations."""
        layout, solver, mass = self.layout, self.solver, self.system.mass
        if not isinstance(solver, AbstractRosenbrock) or not layout.n_states:
            return span.plain
        solver = solver if mass is None else dataclasses.replace(solver, mass=mass)
        path, n = span.inner, layout.n_states
        assert isinstance(path, RosenbrockInterpolation)
        path = RosenbrockInterpolation(
            t0=path.t0, t1=path.t1, y0=path.y0[:n], y1=path.y1[:n], coeffs=path.coeffs[:, :n]
        )  # the integrals do not act on the states
        kept = span.carried[: layout.discrete.stop - n]

        def rates(t: Numbers, states: Array) -> Array:
            point = jnp.concatenate([states, kept])
            return forward * self.system.vector_field(forward * t, point, inputs)

        work = jax.lax.stop_gradient(solver.work(rates, path))

        def vector(t: Array) -> Vector:
            s = within(path, t)
            theta, states = share(path, s), path.evaluate(s)

            # One iteration for the values, another for their derivatives
            def again(shift: Array, _: None) -> tuple[Array, None]:
                return shift + solver.error_within(path, work, theta, path.t1 - path.t0, rates(s, states + shift)), None

            found = states + jax.lax.scan(again, jnp.zeros(n), None, length=EVALUATIONS)[0]
            y = span.plain(t)
            return layout.with_part(y, layout.states, jnp.where(jnp.isfinite(found), found, y[layout.states]))

        return vector

    @property
    def name(self) -> str:
        return "reading"

    def steps(self, arguments: tuple[Any, Any, Inputs, Any]) -> int:
        return arguments[1].size

    def contents(self, arguments: tuple[Any, Any, Inputs, Any]) -> list[object]:
        return [arguments[2].given, digest_of(self.system), self.solver, self.layout]
