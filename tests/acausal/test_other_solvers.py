"""Solvers of diffrax on models with events."""

import math
from typing import Any, Self

import diffrax
import numpy as np
import pytest
from _models import oscillator

from acausal import Component, Discrete, Equations, Events, ModelError, Scalar, Var, eq, simulate, when


class Swing(Component):
    """x = cos t, and how often it has come down through zero."""

    x: Var[Scalar, ""] = 1.0
    v: Var[Scalar, ""] = 0.0
    n: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(speed=eq(d.x, self.v, check_units=False), force=eq(d.v, -self.x, check_units=False))

    def events(self) -> Events:
        return dict(down=when(self.x < 0.0, n=self.n + 1.0))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("solver", "rtol", "error"),
    [(diffrax.Kvaerno3(), 1e-6, 1e-4), (diffrax.Kvaerno5(), 1e-6, 1e-4), (diffrax.ImplicitEuler(), 1e-4, 0.1)],
    ids=["Kvaerno3", "Kvaerno5", "ImplicitEuler"],
)
def test_implicit_solvers_with_events(solver: Any, rtol: float, error: float) -> None:
    sol = simulate(Swing(), 3.0, solver=solver, rtol=rtol, save="end")
    found = np.array([float(sol.final.x), float(sol.final.v)])
    np.testing.assert_allclose(found, [math.cos(3.0), -math.sin(3.0)], atol=error)
    assert sol.final.n == 1.0
    np.testing.assert_allclose(sol.events.times, math.pi / 2, atol=error)


def test_a_solver_without_an_error_estimate_is_refused() -> None:
    with pytest.raises(ModelError, match=r"solver=Euler\(\) does not estimate its error.*diffrax\.Tsit5\(\)"):
        simulate(oscillator(), 1.0, solver=diffrax.Euler())
