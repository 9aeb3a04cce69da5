"""The vectors of a run at any time, from its recorded steps."""

import dataclasses
import functools as ft
from collections.abc import Callable
from typing import Any

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
from .dense import Record
from .interval import LOOKS
from .made_from import digest_of
from .rows import chosen, shared
from .solvers._rosenbrock import AbstractRosenbrock, RosenbrockInterpolation
from .span import Span
from .state_vector import StateVector, Vector
from .stored_program import result_of

AT_ONCE = 64  # times for which matrices are held


@dataclasses.dataclass(frozen=True)
class Paths:
    """The paths of the steps of runs of a model by a method, as the runs themselves read them. Time counts `forward`,
    which is -1 for a run that goes back.
    """

    system: System
    solver: diffrax.AbstractSolver
    layout: StateVector

    def on(self, span: Span, inputs: Inputs, forward: Array) -> Callable[[Array], Vector]:
        """The vector at each time of a step, with its stiff states brought nearer to what the equations say."""
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

            # Once for the values, and once more for their derivatives
            def again(shift: Array, _: None) -> tuple[Array, None]:
                return shift + solver.error_within(path, work, theta, path.t1 - path.t0, rates(s, states + shift)), None

            found = states + jax.lax.scan(again, jnp.zeros(n), None, length=LOOKS)[0]
            y = span.plain(t)
            return layout.with_part(y, layout.states, jnp.where(jnp.isfinite(found), found, y[layout.states]))

        return vector


@dataclasses.dataclass(frozen=True)
class Reading(Paths):
    """The stepped vectors of runs at any times; not a number for times that a run has not come to."""

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
        span, is_there = record.span(forward * t, self.solver, self.layout)
        y = self.on(span, inputs, forward)(forward * t)
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
