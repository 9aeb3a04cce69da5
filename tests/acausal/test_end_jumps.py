"""A warning for derivatives of a run that ends at an event whose time moves with the differentiated parameters."""

import warnings
from typing import Any, Self

import jax
import jax.numpy as jnp
import pytest

from acausal import Component, Discrete, Equations, Events, JumpWarning, Param, Scalar, Time, Var, at, eq, simulate


class Mean(Component):
    """A mean of the time since the last sample, a scale, and a single event."""

    period: Param[Scalar, "s"] = 0.25
    late: Param[Scalar, "s"] = 0.7
    scale: Param[Scalar, ""] = 2.0
    t: Time[Scalar, "s"] = 0.0
    x: Var[Scalar, "s"] = 0.0
    mean: Discrete[Scalar, "s"] = 0.0
    once: Discrete[Scalar, "s"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, self.scale * self.t, check_units=False))

    def events(self) -> Events:
        return dict(sample=at(0.0, every=self.period, mean=self.x), single=at(self.late, once=self.x))


def mean(t1: Any, **numbers: Any) -> Any:
    return simulate(Mean(**numbers), t1, save="end").final.mean


@pytest.mark.parametrize("differentiate", [jax.grad, jax.jacfwd])
def test_a_tick_at_the_end_is_named(differentiate: Any) -> None:
    with pytest.warns(JumpWarning, match=r"at the time of sample, which depends.*Remedy: another end time"):
        differentiate(lambda period: mean(1.0, period=period))(0.25)
    with pytest.warns(JumpWarning, match=r"at the time of single, which"):
        differentiate(lambda late: mean(0.7, late=late))(0.7)


@pytest.mark.thorough
def test_nothing_is_said_of_other_runs() -> None:
    """Runs that end between ticks, whose ticks do not move or move with the end, and that are not differentiated."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert jax.grad(lambda period: mean(0.9, period=period))(0.25) == pytest.approx(2.0 * 0.75 * 3.0)
        assert jax.grad(lambda scale: mean(1.0, scale=scale))(2.0) == pytest.approx(0.75**2 / 2.0)
        jax.grad(lambda period: mean(4.0 * period, period=period))(0.25)
        mean(1.0)
        jax.jit(jax.grad(lambda period: mean(1.0, period=period)))(jnp.asarray(0.25))
