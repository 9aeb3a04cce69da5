"""Models of many parts, whose parameters are collected before they are handed to the compiled run."""

import math
from typing import Any, Self

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Discrete, Equations, Events, Param, Scalar, Var, eq, simulate, when
from acausal._evaluate import intake
from acausal._evaluate.building import system_of


class Tank(Component):
    """dx/dt = -x / T, of which an event at half its start notes the time constant."""

    T: Param[Scalar, "s"]
    level: Param[Scalar, "1"] = 0.5
    noted: Discrete[Scalar, "s"] = 0.0
    x: Var[Scalar, "1"] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(law=eq(self.T * d.x, -self.x))

    def events(self) -> Events:
        return dict(half=when(self.x < self.level, noted=self.T))


class Tanks(Component):
    parts: tuple[Tank, ...]
    limit: Param[Scalar, "1"] = 0.25  # of no equation
    scale: Param[Scalar, "1"] = 3.0

    def connections(self) -> tuple[()]:
        return ()


def _run(model: Tanks) -> Any:
    solution = simulate(
        model,
        20.0,
        until=lambda s: s.parts[0].x - s.limit,
        integrals=lambda s: {"first": s.scale * s.parts[0].x / s.parts[0].T},
        save="end",
        rtol=1e-9,
    )
    return solution.t1, solution.integrals["first"][-1], solution.final.parts[0].noted, solution.final.scale


@pytest.mark.thorough
def test_functions_read_parameters_that_are_collected(monkeypatch: pytest.MonkeyPatch) -> None:
    """t1 = -T ln(limit), the integral is scale (1 - limit), and the event notes T."""
    monkeypatch.setattr(intake, "LARGE", 10)
    model = Tanks(parts=tuple(Tank(T=2.0 + 0.1 * i) for i in range(9)))
    assert _run(model) == pytest.approx((2.0 * math.log(4.0), 2.25, 2.0, 3.0), rel=1e-7)
    found: Any = eqx.filter_jacrev(lambda model: jnp.stack(_run(model)))(model)
    derivatives = {"limit": found.limit, "scale": found.scale, "T": found.parts[0].T, "of another": found.parts[1].T}
    expected = {
        "limit": [-8.0, -3.0, 0.0, 0.0],
        "scale": [0.0, 0.75, 0.0, 1.0],
        "T": [math.log(4.0), 0.0, 1.0, 0.0],
        "of another": [0.0, 0.0, 0.0, 0.0],
    }
    for name, values in derivatives.items():
        np.testing.assert_allclose(values, expected[name], rtol=1e-6, atol=1e-6, err_msg=name)


def test_inputs_of_a_large_model_hold_no_separate_leaves(monkeypatch: pytest.MonkeyPatch) -> None:
    model = Tanks(parts=tuple(Tank(T=2.0 + 0.1 * i) for i in range(9)))
    system = system_of(model)
    y = jnp.arange(1.0, 10.0)
    rates = system.vector_field(0.0, y, system.pack(model))
    monkeypatch.setattr(intake, "LARGE", 10)
    inputs = system.pack(model)
    assert not inputs.params.leaves
    np.testing.assert_allclose(system.vector_field(0.0, y, inputs), rates, rtol=1e-14)
