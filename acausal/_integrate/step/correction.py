"""Correction of the stiff components of the dense output by the equations."""

import functools as ft
from collections.abc import Sequence

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import PyTree

from ..._numbers import Numbers
from ..._tracing import array_of, pushed
from ..setup.field import RunArgs, vector_field
from ..setup.settings import Settings
from ..setup.state_vector import Vector
from ..solvers._rosenbrock import AbstractRosenbrock, RosenbrockInterpolation, Work


class Correction(eqx.Module):
    """Data for correcting the states on the dense output of a step (see `AbstractRosenbrock.error_within`). Times and
    rates are in the solver's time, which always increases.
    """

    solver: AbstractRosenbrock
    work: Work
    args: RunArgs  # with the values held during the step
    settings: Settings = eqx.field(static=True)

    def rates(self, t: Numbers, y: Vector) -> Array:
        """Rates of the states at a point."""
        layout, forward = self.settings.layout, self.args.forward
        return forward * vector_field(self.settings)(forward * t, layout.core(y), self.args)[layout.states]

    def error(self, inner: diffrax.AbstractLocalInterpolation, theta: Numbers, rates: Array) -> Array:
        """Correction of the states at the relative position `theta`, for the `rates` by the equations there."""
        assert isinstance(inner, RosenbrockInterpolation)
        lacking = self.solver.error_within(inner, self.work, theta, inner.t1 - inner.t0, self._core(rates))
        return lacking[self.settings.layout.states]

    def error_at(self, inner: diffrax.AbstractLocalInterpolation, t: Numbers, rates: Array) -> Array:
        """Correction of the states at a time on the dense output."""
        return self.error(inner, share(inner, t), rates)

    def shift(self, inner: diffrax.AbstractLocalInterpolation, t: Numbers, y: Vector) -> Array:
        """Correction of the states y of the dense output at t."""
        return self.error_at(inner, t, self.rates(t, y))

    def shifted(self, y: Vector, shift: Array) -> Vector:
        """The vector with `shift` added to its states."""
        states = self.settings.layout.states
        return self.settings.layout.with_part(y, states, y[states] + shift)

    def rate_correction(self, pace: Array, rates: Vector) -> Vector:
        """Correction of the rates of the vector, in the time of the model, if the dense output has the slope `pace`.
        The rates of stiff components by the equations amplify the errors of these components.
        """
        layout, forward = self.settings.layout, self.args.forward
        core = self._core(forward * pace - rates[layout.states])
        # Algebraic unknowns of the mass-matrix form have no rates.
        stiff = self.solver.mass_times(self.solver.of_stiff(self.work.factors, core))[layout.states]
        return layout.with_part(jnp.zeros(layout.size), layout.states, jnp.where(jnp.isfinite(stiff), stiff, 0.0))

    def _core(self, states: Array) -> Array:
        """The states padded with zeros for the integrals, on which no state depends."""
        return jnp.concatenate([states, jnp.zeros(self.settings.n_extra)]) if self.settings.n_extra else states


def share(inner: diffrax.AbstractLocalInterpolation, t: Numbers) -> Numbers:
    """The relative position of t in a step."""
    return (t - inner.t0) / jnp.where(inner.t1 == inner.t0, 1.0, inner.t1 - inner.t0)


def within(inner: diffrax.AbstractLocalInterpolation, t: Numbers) -> Numbers:
    """The time t, limited to the end of the step, which rounding may exceed. Its derivative is that of t."""
    return t - jax.lax.stop_gradient(jnp.maximum(t - inner.t1, 0.0))


@jax.custom_jvp
def corrected(
    correction: Correction,
    inner: diffrax.AbstractLocalInterpolation,
    y: Vector,
    shift: Array,
    theta: Numbers,
    t: Numbers,
    point: Vector,
) -> Vector:
    """The vector y of a dense output with the known correction `shift`. Its derivatives are corrected in the same way,
    with the rates at the time t (relative position theta) and the `point` of the dense output there. These are the time
    and the vector of y, or slightly earlier ones if the equations have a kink at y.
    """
    del inner, theta, t, point
    return correction.shifted(y, shift)


@ft.partial(corrected.defjvp, symbolic_zeros=True)
def _derivative(primals: Sequence[PyTree], tangents: Sequence[PyTree]) -> tuple[Vector, Vector]:
    correction, inner, y, shift, theta, t, point = primals
    of_course, of_inner, of_y, _, of_share, of_time, of_point = tangents

    def lacking(
        args: RunArgs, inner: diffrax.AbstractLocalInterpolation, theta: Numbers, t: Numbers, y: Vector
    ) -> Array:
        return correction.error(inner, theta, eqx.tree_at(lambda c: c.args, correction, args).rates(t, y))

    place, dy = correction.shifted(point, shift), jnp.asarray(array_of(of_y))
    moving = (of_course.args, of_inner, of_share, of_time, jnp.asarray(array_of(of_point)))
    _, change = pushed(lacking, (correction.args, inner, theta, t, place), moving)
    return correction.shifted(y, shift), correction.shifted(dy, change)
