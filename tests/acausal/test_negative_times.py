"""Runs at negative times, and backwards, are those at positive times: nothing counts from zero."""

from typing import Any, Self

import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Discrete, Equations, Events, Param, Scalar, Time, Var, at, eq, ifelse, simulate, when


class Driven(Component, partial=True):
    """x decays half as fast from the time T on, and y is driven by a wave."""

    T: Param[Scalar, "s"]
    shift: Param[Scalar, "s"]
    t: Time[Scalar, "s"] = 0.0
    x: Var[Scalar, "1"] = 1.0
    y: Var[Scalar, "1"] = 0.0

    def rate(self) -> Scalar:
        """The rate of the decay in 1/s."""
        return jnp.where(self.t < self.T, 1.0, 0.5)

    def equations(self, d: Self) -> Equations:
        wave = jnp.cos(3.0 * (self.t - self.shift))
        return dict(x=eq(d.x, -self.rate() * self.x, check_units=False), y=eq(d.y, wave, check_units=False))


class Known(Driven):
    """The time is known ahead, and nothing has to be searched for."""


class Bent(Driven):
    """Besides, an equation has a law in two pieces, which are the same."""

    def rate(self) -> Scalar:
        return super().rate() * ifelse(self.y > 0.0, 1.0, 1.0)


class Scheduled(Driven):
    """The decay is changed by an event."""

    k: Discrete[Scalar, "1/s"] = 1.0

    def rate(self) -> Scalar:
        return self.k

    def events(self) -> Events:
        return dict(slower=at(self.T, k=0.5))


class Searched(Driven):
    """Besides, a condition becomes true."""

    n: Discrete[Scalar, "1"] = 0.0

    def events(self) -> Events:
        return dict(count=when(self.y > 0.2, n=self.n + 1.0))


@pytest.mark.parametrize("model", [Known, Bent, Scheduled, Searched])
@pytest.mark.parametrize("t0", [-10.0, -4.0, 0.0])
def test_a_run_that_is_shifted(model: Any, t0: float) -> None:
    sol = simulate(model(T=t0 + 5.0, shift=t0), t0 + 9.0, t0=t0, save="end", rtol=1e-8)
    np.testing.assert_allclose(sol.final.x, np.exp(-7.0), rtol=1e-6)
    np.testing.assert_allclose(sol.final.y, np.sin(27.0) / 3.0, rtol=1e-6)


@pytest.mark.parametrize("model", [Known, Bent])
@pytest.mark.parametrize("t1", [-4.0, 0.0, 3.0])
def test_a_run_backwards(model: Any, t1: float) -> None:
    sol = simulate(model(T=t1 + 5.0, shift=t1), t1, t0=t1 + 9.0, save="end", rtol=1e-8)
    np.testing.assert_allclose(sol.final.x, np.exp(7.0), rtol=1e-6)
    np.testing.assert_allclose(sol.final.y, -np.sin(27.0) / 3.0, rtol=1e-6)
