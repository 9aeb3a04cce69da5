"""The dense output of a step where its stiff components are brought nearer to what the equations say."""

import functools as ft
from collections.abc import Sequence

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import PyTree

from ..._numbers import Numbers
from ..._tangents import array_of, pushed
from ..setup.field import Given, vector_field
from ..setup.settings import Settings
from ..setup.state_vector import Vector
from ..solvers._rosenbrock import AbstractRosenbrock, RosenbrockInterpolation, Work


class Course(eqx.Module):
    """What it takes to correct the states on the path of a step: see `AbstractRosenbrock.error_within`. Times and rates
    are those of the solver, which counts forwards.
    """

    solver: AbstractRosenbrock
    work: Work
    given: Given  # with what is carried along the step
    settings: Settings = eqx.field(static=True)

    def rates(self, t: Numbers, y: Vector) -> Array:
        """Of the states, at a point."""
        layout, forward = self.settings.layout, self.given.direction
        return forward * vector_field(self.settings)(forward * t, layout.core(y), self.given)[layout.states]

    def error(self, inner: diffrax.AbstractLocalInterpolation, theta: Numbers, rates: Array) -> Array:
        """What the states lack at a share of the step on the path, where the equations say `rates`."""
        assert isinstance(inner, RosenbrockInterpolation)
        lacking = self.solver.error_within(inner, self.work, theta, inner.t1 - inner.t0, self._core(rates))
        return lacking[self.settings.layout.states]

    def error_at(self, inner: diffrax.AbstractLocalInterpolation, t: Numbers, rates: Array) -> Array:
        """What the states lack at a time on the path."""
        return self.error(inner, share(inner, t), rates)

    def shift(self, inner: diffrax.AbstractLocalInterpolation, t: Numbers, y: Vector) -> Array:
        """What the states y of the path lack at t."""
        return self.error_at(inner, t, self.rates(t, y))

    def moved(self, y: Vector, shift: Array) -> Vector:
        """The vector with this added to its states."""
        states = self.settings.layout.states
        return self.settings.layout.with_part(y, states, y[states] + shift)

    def lag(self, pace: Array, rates: Vector) -> Vector:
        """What is to be added to the rates of the vector, in the time of the model, where the states move at this pace
        on the path: stiff components tell their rates only but for their error, which they multiply.
        """
        layout, forward = self.settings.layout, self.given.direction
        core = self._core(forward * pace - rates[layout.states])
        # Algebraic unknowns of the mass-matrix form have no rates.
        stiff = self.solver.mass_times(self.solver.of_stiff(self.work.factors, core))[layout.states]
        return layout.with_part(jnp.zeros(layout.size), layout.states, jnp.where(jnp.isfinite(stiff), stiff, 0.0))

    def _core(self, states: Array) -> Array:
        """With nothing for the integrals, on which no state depends."""
        return jnp.concatenate([states, jnp.zeros(self.settings.n_extra)]) if self.settings.n_extra else states


def share(inner: diffrax.AbstractLocalInterpolation, t: Numbers) -> Numbers:
    """The share of a step that has passed at t."""
    return (t - inner.t0) / jnp.where(inner.t1 == inner.t0, 1.0, inner.t1 - inner.t0)


def within(inner: diffrax.AbstractLocalInterpolation, t: Numbers) -> Numbers:
    """The time t, or the end of the step where t is behind that by rounding; it moves as t does."""
    return t - jax.lax.stop_gradient(jnp.maximum(t - inner.t1, 0.0))


@jax.custom_jvp
def on_course(
    course: Course,
    inner: diffrax.AbstractLocalInterpolation,
    y: Vector,
    shift: Array,
    theta: Numbers,
    t: Numbers,
    point: Vector,
) -> Vector:
    """The vector y of a path with what it lacks there, which has been found to be `shift`. Its derivatives are
    corrected in the same way, by rates at t, a share theta of the step, and the `point` of the path there: those of y,
    or just before, where equations bend at y.
    """
    del inner, theta, t, point
    return course.moved(y, shift)


@ft.partial(on_course.defjvp, symbolic_zeros=True)
def _derivative(primals: Sequence[PyTree], tangents: Sequence[PyTree]) -> tuple[Vector, Vector]:
    course, inner, y, shift, theta, t, point = primals
    of_course, of_inner, of_y, _, of_share, of_time, of_point = tangents

    def lacking(
        given: Given, inner: diffrax.AbstractLocalInterpolation, theta: Numbers, t: Numbers, y: Vector
    ) -> Array:
        return course.error(inner, theta, eqx.tree_at(lambda c: c.given, course, given).rates(t, y))

    place, dy = course.moved(point, shift), jnp.asarray(array_of(of_y))
    moving = (of_course.given, of_inner, of_share, of_time, jnp.asarray(array_of(of_point)))
    _, change = pushed(lacking, (course.given, inner, theta, t, place), moving)
    return course.moved(y, shift), course.moved(dy, change)
