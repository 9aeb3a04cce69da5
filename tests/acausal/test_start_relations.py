"""A run from the result of `initialise` holds the relations of `ifelse` as a run of the model does."""

from collections.abc import Callable
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Connections, Equations, Scalar, Time, Var, connect, eq, ifelse, initialise, simulate
from components import blocks

TIMES = jnp.linspace(0.05, 2.95, 30)


class Followed(Component):
    """A signal in pieces, which a lag follows."""

    signal: blocks.Ramp | blocks.Trapezoid
    lag: blocks.FirstOrder

    def connections(self) -> Connections:
        return (connect(self.signal.y, self.lag.u),)


SIGNALS = {
    "ramp": blocks.Ramp(height=1.0, duration=1.0, start_time=0.3),
    "wave": blocks.Trapezoid(amplitude=1.0, period=2.5, start_time=0.3, rising=0.3, width=0.6, falling=0.3),
}


@pytest.mark.thorough
@pytest.mark.parametrize("name", SIGNALS)
def test_a_searched_start_changes_no_law_in_pieces(name: str) -> None:
    model = Followed(signal=SIGNALS[name], lag=blocks.FirstOrder(k=1.0, T=0.5))
    expected = simulate(model, 3.0, save=TIMES)
    once = initialise(model)
    for start in (once, initialise(once)):
        found = simulate(start, 3.0, save=TIMES)
        for path in ("signal.y.value", "lag.y.value"):
            np.testing.assert_allclose(found[path], expected[path], atol=1e-6)


class Settled(Component):
    """x' = u and y = x + u, where u = 1 - t before t = 1, and -2 then."""

    x: Var[Scalar, ""] = 0.0
    y: Var[Scalar, ""] = 0.0
    t: Time[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        u = ifelse(self.t < 1.0, 1.0 - self.t, -2.0)
        return dict(rate=eq(d.x, u, check_units=False), sum=eq(self.y, self.x + u))


def test_a_start_value_of_a_variable_that_depends_on_a_mode_determines_the_state() -> None:
    model = Settled(y=0.5)
    for start in (model, initialise(model)):
        solution = simulate(start, 0.25)
        np.testing.assert_allclose(solution["y"][0], 0.5, atol=1e-9)
        np.testing.assert_allclose(solution["x"][0], -0.5, atol=1e-9)
        np.testing.assert_allclose(solution["x"][-1], -0.5 + 0.25 - 0.5 * 0.25**2, atol=1e-9)


@pytest.mark.thorough
@pytest.mark.parametrize("derivative", [jax.jacfwd, jax.grad])
def test_the_state_follows_such_a_start_value_in_derivatives(derivative: Callable[..., Any]) -> None:
    def end(y: Scalar) -> Scalar:
        return simulate(Settled(y=y), 0.25, save="end").final.x

    assert float(derivative(end)(0.5)) == pytest.approx(1.0, abs=1e-9)
