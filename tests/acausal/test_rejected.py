"""Reverse mode through steps that are rejected since equations have no solution, or no slope, at their end."""

from collections.abc import Callable
from typing import Any, Self

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array

from acausal import Component, Equations, Param, Rodas5P, Scalar, Var, eq, simulate

RATES = jnp.array([0.5, 2.0])  # 1/s
TOO_LONG = 1.0  # s, the first step that is tried


class Outflow(Component):
    """Flows with the root of what is left, of which there may be too little."""

    rate: Param[Scalar, "1/s"]
    gone: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(flow=eq(d.gone, self.rate * (jnp.sqrt(1.0 - self.gone) * (1.0 + 3.0 * self.gone) - 0.5)))


class ImplicitOutflow(Component):
    """The same, with the root searched for."""

    rate: Param[Scalar, "1/s"]
    gone: Var[Scalar, "1"] = 0.0
    level: Var[Scalar, "1"] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(
            flow=eq(d.gone, self.rate * (self.level * (1.0 + 3.0 * self.gone) - 0.5)),
            law=eq(self.level**2, 1.0 - self.gone),
        )


class Clipped(Component):
    """The same, where nothing flows below an empty level, and a root has a slope without bound."""

    rate: Param[Scalar, "1/s"]
    gone: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        level = jnp.sqrt(jnp.maximum(1.0 - self.gone, 0.0))
        return dict(flow=eq(d.gone, self.rate * (level * (1.0 + 3.0 * self.gone) - 0.5)))


def clipped(rate: Scalar, adjoint: diffrax.AbstractAdjoint | None) -> Scalar:
    return simulate(Clipped(rate=rate), 1.0, save="end", dt0=TOO_LONG, adjoint=adjoint).final.gone


def clipped_stop(rate: Scalar, adjoint: diffrax.AbstractAdjoint | None) -> Scalar:
    model = Clipped(rate=rate)
    return simulate(model, 9.0, until=lambda s: s.gone - 0.5, save="end", dt0=TOO_LONG, adjoint=adjoint).t1


def saved(rate: Scalar, adjoint: diffrax.AbstractAdjoint | None) -> Scalar:
    sol = simulate(Outflow(rate=rate), 1.0, save=[0.2, 1.0], dt0=TOO_LONG, adjoint=adjoint, max_steps=64)
    return jnp.sum(sol.gone)


def final(rate: Scalar, adjoint: diffrax.AbstractAdjoint | None) -> Scalar:
    return simulate(ImplicitOutflow(rate=rate), 1.0, save="end", dt0=TOO_LONG, adjoint=adjoint).final.gone


def stopped(rate: Scalar, adjoint: diffrax.AbstractAdjoint | None) -> Scalar:
    model = ImplicitOutflow(rate=rate)
    return simulate(model, 9.0, until=lambda s: s.gone - 0.5, save="end", dt0=TOO_LONG, adjoint=adjoint).t1


@pytest.mark.parametrize(
    "quantity", [saved, final, clipped, clipped_stop, pytest.param(stopped, marks=pytest.mark.slow)]
)
def test_reverse_mode_passes_by(quantity: Callable[..., Scalar]) -> None:
    back = diffrax.RecursiveCheckpointAdjoint()
    gradients = jax.jit(jax.vmap(jax.grad(lambda rate: quantity(rate, back))))(RATES)
    np.testing.assert_allclose(gradients, jax.vmap(jax.grad(lambda rate: quantity(rate, None)))(RATES), rtol=1e-9)


@pytest.mark.thorough
def test_a_failed_step_does_not_tell_where_the_next_one_ends() -> None:
    """Both modes take the same steps, at times other than zero, too."""

    def steps(adjoint: diffrax.AbstractAdjoint | None) -> Any:
        model = Outflow(rate=RATES[1])
        run = simulate(model, 9.0, t0=1.0, until=lambda s: s.gone - 0.5, save="end", dt0=TOO_LONG, adjoint=adjoint)
        return run.stats["num_steps"]

    assert steps(diffrax.RecursiveCheckpointAdjoint()) == steps(None)


@pytest.mark.thorough
def test_the_first_step_has_no_root() -> None:
    """For the first of the rates it has."""

    def flow(t: Any, gone: Array, rate: Array) -> Array:
        return rate * (jnp.sqrt(1.0 - gone) * (1.0 + 3.0 * gone) - 0.5)

    term = diffrax.ODETerm(flow)
    ends = [Rodas5P().step(term, 0.0, TOO_LONG, jnp.zeros(1), rate, None, False)[0] for rate in RATES]
    assert np.isfinite(np.asarray(ends)).ravel().tolist() == [True, False]
