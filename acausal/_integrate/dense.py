"""The points of a run whose dense output was kept, at any time."""

import dataclasses
import functools as ft
from typing import Any, NamedTuple

import diffrax
import jax
import jax.numpy as jnp
from jax import Array

from .._evaluate.starts import Inputs
from .._evaluate.system import System
from .._numbers import Numbers
from .course import share, within
from .interval import LOOKS
from .solvers._rosenbrock import AbstractRosenbrock, RosenbrockInterpolation
from .span import Span
from .state_vector import StateVector

AT_ONCE = 64  # times for which matrices are held


class Pieces(NamedTuple):
    """The dense output of all steps: the start of the run and the ends of the steps, in the order of time, infinite
    after the last one; and what each step is evaluated from.
    """

    ts: Any
    infos: Any

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


@ft.partial(jax.jit, static_argnums=(0, 1, 2))
def points_at(
    system: System,
    solver: diffrax.AbstractSolver,
    layout: StateVector,
    t: Array,
    pieces: Pieces,
    inputs: Inputs,
    forward: Array,
    start: Array,
) -> Array:
    """Vectors from which the equations are evaluated, as the run itself would have read them at times t. Time counts
    `forward`, which is -1 for a run that goes back; `start` is the vector at the start.
    """

    def point(t: Array) -> Array:
        span, is_there = pieces.span(forward * t, solver, layout)
        y = span.plain(forward * t)[layout.point]
        if isinstance(solver, AbstractRosenbrock) and layout.n_states:
            method = solver if system.mass is None else dataclasses.replace(solver, mass=system.mass)
            states = _states(method, system, layout, span, t, forward, inputs)
            y = layout.with_part(y, layout.states, jnp.where(jnp.isfinite(states), states, y[layout.states]))
        is_start = (forward * t == pieces.ts[0]) & ~is_there
        return jnp.where(is_there, y, jnp.where(is_start, start, jnp.nan))

    return jax.lax.map(point, t, batch_size=AT_ONCE) if jnp.ndim(t) else point(t)


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
