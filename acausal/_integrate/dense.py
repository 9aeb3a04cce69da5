"""The recorded steps of a run, and its points at any time."""

import dataclasses
import functools as ft
from typing import Any, NamedTuple

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._evaluate.starts import Inputs
from .._evaluate.system import System
from .._numbers import Numbers
from .._tracing import is_traced
from .course import share, within
from .interval import LOOKS
from .made_from import digest_of
from .rows import chosen, shared
from .solvers._rosenbrock import AbstractRosenbrock, RosenbrockInterpolation
from .span import Span
from .state_vector import StateVector
from .stored_program import result_of

AT_ONCE = 64  # times for which matrices are held


class Record(NamedTuple):
    """The steps of a run, of which `n` are there.

    - `ts`, `ys`: the start and the ends of the steps, in the order of time, infinite after the last one, and the
      vectors there, after what happens at the end of a step.
    - `moments`, `befores`: of each step, the time of the first listed event at its end and the vector just before it,
      infinite if there is none.
    - `infos`: what the dense output of each step is evaluated from; None if only the ends are kept.
    """

    ts: Any
    ys: Any
    moments: Any
    befores: Any
    infos: Any
    n: Any

    def at(self, t: Array) -> tuple[Any, Array]:
        """What the step is evaluated from in which a time lies, the one before where it is the end of one; and whether
        the run has come there.
        """
        index = jnp.clip(jnp.searchsorted(self.ts, t) - 1, 0, len(self.ts) - 2)
        last = jnp.max(jnp.where(jnp.isfinite(self.ts), self.ts, -jnp.inf))
        return jax.tree.map(lambda x: x[index], self.infos), (t >= self.ts[0]) & (t <= last) & (last > self.ts[0])

    def span(self, t: Array, solver: diffrax.AbstractSolver, layout: StateVector) -> tuple[Span, Array]:
        """The step in which a time lies, and whether the run has come there."""
        info, is_there = self.at(t)
        path = solver.interpolation_cls(t0=info["begin"], t1=info["end"], **info["inner"])
        return Span(path.t0, path.t1, path, info["carried"], layout), is_there


@dataclasses.dataclass(frozen=True)
class Reading:
    """The stepped vectors of runs of a model by a method at any times, as the runs themselves would have read them; not
    a number for times that a run has not come to. Time counts `forward`, which is -1 for a run that goes back.
    """

    system: System
    solver: diffrax.AbstractSolver
    layout: StateVector

    def at(self, t: Numbers, record: Record, inputs: Inputs, forward: Numbers) -> Array:
        """The vectors at a time or at several."""
        given = (record, inputs, forward)
        if any(is_traced(leaf) for leaf in jax.tree.leaves((t, given))):
            return self((jnp.asarray(t), *given))
        t = np.asarray(t)
        times = np.ravel(t)
        found = result_of(self, (times[shared(times.size)], *given))
        return chosen(found, slice(times.size)).reshape(*t.shape, -1)

    def __call__(self, given: tuple[Array, Record, Inputs, Array]) -> Array:
        return _read(self, given)

    def vector(self, t: Array, record: Record, inputs: Inputs, forward: Array) -> Array:
        """The vector at a time."""
        solver, layout = self.solver, self.layout
        span, is_there = record.span(forward * t, solver, layout)
        y = span.plain(forward * t)
        if isinstance(solver, AbstractRosenbrock) and layout.n_states:
            mass = self.system.mass
            method = solver if mass is None else dataclasses.replace(solver, mass=mass)
            states = _states(method, self.system, layout, span, t, forward, inputs)
            y = layout.with_part(y, layout.states, jnp.where(jnp.isfinite(states), states, y[layout.states]))
        is_start = (forward * t == record.ts[0]) & ~is_there
        return jnp.where(is_there, y, jnp.where(is_start, record.ys[0], jnp.nan))

    @property
    def name(self) -> str:
        return "reading"

    def contents(self, given: tuple[Any, Record, Inputs, Any]) -> list[object]:
        return [given[2].given, digest_of(self.system), self.solver, self.layout]

    def held(self) -> dict[str, Any]:
        return {}


@ft.partial(jax.jit, static_argnums=0)
def _read(reading: Reading, given: tuple[Array, Record, Inputs, Array]) -> Array:
    t, *others = given
    if not jnp.ndim(t):
        return reading.vector(t, *others)
    return jax.lax.map(lambda t: reading.vector(t, *others), t, batch_size=AT_ONCE)


def _states(
    solver: AbstractRosenbrock,
    system: System,
    layout: StateVector,
    span: Span,
    t: Array,
    forward: Array,
    inputs: Inputs,
) -> Array:
    """The states on the path of the step that a time belongs to."""
    path, n = span.inner, layout.n_states
    assert isinstance(path, RosenbrockInterpolation)
    path = RosenbrockInterpolation(
        t0=path.t0, t1=path.t1, y0=path.y0[:n], y1=path.y1[:n], coeffs=path.coeffs[:, :n]
    )  # the integrals do not act on the states
    kept = span.carried[: layout.discrete.stop - n]

    def rates(t: Numbers, states: Array) -> Array:
        return forward * system.vector_field(forward * t, jnp.concatenate([states, kept]), inputs)

    work = jax.lax.stop_gradient(solver.work(rates, path))
    s = within(path, forward * t)
    theta, states = share(path, s), path.evaluate(s)

    # Once for the values, and once more for their derivatives
    def again(shift: Array, _: None) -> tuple[Array, None]:
        return shift + solver.error_within(path, work, theta, path.t1 - path.t0, rates(s, states + shift)), None

    return states + jax.lax.scan(again, jnp.zeros(n), None, length=LOOKS)[0]
