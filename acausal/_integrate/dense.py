"""The points of a run whose dense output was kept, at any time."""

import dataclasses
import functools as ft

import diffrax
import jax
import jax.numpy as jnp
from jax import Array

from .._diffrax_private import piece_of
from .._evaluate.starts import Inputs
from .._evaluate.system import System
from .interval import LOOKS
from .solvers._rosenbrock import AbstractRosenbrock, RosenbrockInterpolation
from .span import Span
from .state_vector import StateVector

AT_ONCE = 64  # times for which matrices are held


@ft.partial(jax.jit, static_argnums=(0, 1, 2))
def points_at(
    system: System,
    solver: diffrax.AbstractSolver,
    layout: StateVector,
    t: Array,
    dense: diffrax.DenseInterpolation,
    inputs: Inputs,
) -> Array:
    """Vectors from which the equations are evaluated, as the run itself would have read them at times t."""

    def point(t: Array) -> Array:
        y = dense.evaluate(t)[layout.point]
        if not isinstance(solver, AbstractRosenbrock) or layout.n_states == 0:
            return y
        method = solver if system.mass is None else dataclasses.replace(solver, mass=system.mass)
        states = _states(method, system, layout, dense, t, inputs)
        is_there = jnp.isfinite(dense.derivative(t)[layout.states])
        return layout.with_part(y, layout.states, jnp.where(is_there, states, y[layout.states]))

    return jax.lax.map(point, t, batch_size=AT_ONCE) if jnp.ndim(t) else point(t)


def _states(
    solver: AbstractRosenbrock,
    system: System,
    layout: StateVector,
    dense: diffrax.DenseInterpolation,
    t: Array,
    inputs: Inputs,
) -> Array:
    """The states on the path of the step that a time belongs to."""
    span = piece_of(dense, t)
    assert isinstance(span, Span)
    path, n, forward = span.inner, layout.n_states, jnp.asarray(dense.direction)
    assert isinstance(path, RosenbrockInterpolation)
    path = RosenbrockInterpolation(
        t0=path.t0, t1=path.t1, y0=path.y0[:n], y1=path.y1[:n], coeffs=path.coeffs[:, :n]
    )  # the integrals do not act on the states
    kept = span.carried[: layout.discrete.stop - n]

    def rates(t: Array, states: Array) -> Array:
        return forward * system.vector_field(forward * t, jnp.concatenate([states, kept]), inputs)

    work = jax.lax.stop_gradient(solver.work(rates, path))
    s = forward * t
    theta, states = (s - path.t0) / jnp.where(path.t1 == path.t0, 1.0, path.t1 - path.t0), path.evaluate(s)

    # Once for the values, and once more for their derivatives
    def again(shift: Array, _: None) -> tuple[Array, None]:
        return shift + solver.error_within(path, work, theta, path.t1 - path.t0, rates(s, states + shift)), None

    return states + jax.lax.scan(again, jnp.zeros(n), None, length=LOOKS)[0]
