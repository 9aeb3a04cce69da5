"""Rates that grow exponentially: a step far too long must not pass for an accurate one."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Equations, Events, Param, Result, Scalar, Var, at, eq, prefer, simulate


class Steep(Component):
    """A quantity that falls by an exponential law, dx/dt = -exp(c (x - 1)), as a charge through a diode does."""

    c: Param[Scalar, "1"]
    x: Var[Scalar, "1", prefer] = 5.0

    def equations(self, d: Self) -> Equations:
        return dict(runs=eq(d.x, -jnp.exp(self.c * (self.x - 1.0)), check_units=False))


@pytest.mark.thorough
def test_runs_off_by_an_exponential_law() -> None:
    """exp(-c (x - 1)) = c t + exp(-c (x0 - 1)), from rates of up to 1e100 at the start: found, or told to be lost."""
    c = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 10.0, 20.0, 40.0, 60.0])
    expected = 1.0 - np.log(c + np.exp(-4.0 * c)) / c
    for first in (None, 1.0):

        @jax.jit
        @jax.vmap
        def run(c: Any, dt0: float | None = first) -> Any:
            sol = simulate(Steep(c=c), 1.0, dt0=dt0, rtol=1e-8, save="end", throw=False)
            return sol.final.x, sol.result == Result.step_too_small

        x, is_lost = run(c)
        np.testing.assert_array_equal(is_lost[:6], False)
        np.testing.assert_allclose(x[~is_lost], expected[~is_lost], rtol=1e-6)


class Kicked(Component):
    """A body that is set to a speed far beyond its size at 0.5 s."""

    v: Param[Scalar, ""] = 1e12
    x: Var[Scalar, ""] = 0.0
    w: Var[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(speed=eq(d.x, self.w, check_units=False), coasts=eq(d.w))

    def events(self) -> Events:
        return dict(kick=at(0.5, w=self.v))


@pytest.mark.thorough
def test_an_event_may_set_a_state_to_any_size() -> None:
    """A jump set by an event is no failed step, and neither is the following step: x = v (t - 0.5)."""
    slope = jax.jacfwd(lambda v: simulate(Kicked(v=v), 1.0, save="end").final.x)(1e12)
    np.testing.assert_allclose(np.array([slope, simulate(Kicked(), 1.0, save="end").final.x / 1e12]), 0.5, rtol=1e-9)
