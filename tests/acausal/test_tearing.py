"""Simultaneous equations: linear and nonlinear blocks against other solvers."""

import jax.numpy as jnp
import numpy as np
import pytest
from _models import rectifier
from scipy.optimize import brentq

from acausal import Array as Parts
from acausal import Component, Connections, connect, simulate, stack
from components.electrical import ConstantVoltage, Ground, Resistor


class Divider(Component):
    """A circuit without states."""

    source: ConstantVoltage
    upper: Resistor
    lower: Resistor
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.source.p, self.upper.p),
            connect(self.upper.n, self.lower.p),
            connect(self.lower.n, self.source.n, self.ground.p),
        )


@pytest.mark.thorough
def test_model_without_states() -> None:
    model = Divider(source=ConstantVoltage(V=10.0), upper=Resistor(R=3.0), lower=Resistor(R=2.0))
    sol = simulate(model, 1.0, save=jnp.array([0.0, 0.5, 1.0]))
    np.testing.assert_allclose(sol["lower.v"], [4.0, 4.0, 4.0])


def diode_voltage(V: float) -> float:
    """At the first moment, with the capacitor empty, by bisection."""
    excess = lambda v: 1e-12 * (np.exp(v / 0.025) - 1.0) - (V - v) / 100.0  # noqa: E731
    return float(brentq(excess, -10.0, 1.0, xtol=1e-14))  # pyright: ignore[reportArgumentType]


class Bank(Component):
    members: Parts


VOLTAGES = np.array([1.0, 5.0, 6.0, 7.0, 8.0, 8.2, 10.0, 20.0, 48.0, 100.0])


@pytest.mark.thorough
@pytest.mark.parametrize("V", [5.0, 8.0, 325.0, -10.0])
def test_diode(V: float) -> None:
    """From the start value of 0.6 V a full Newton step overshoots far at mains voltage, and comes back 25 mV a step."""
    sol = simulate(rectifier(V), 0.01, save=jnp.array([0.0]), rtol=1e-8)
    np.testing.assert_allclose(sol["diode.v"][0], diode_voltage(V), rtol=1e-9)


@pytest.mark.slow
def test_bank_of_diodes() -> None:
    """Many alike nonlinear blocks, solved side by side."""
    model = Bank(members=stack([rectifier(V) for V in VOLTAGES.tolist()]))
    sol = simulate(model, 0.01, save=jnp.array([0.0]), rtol=1e-8)
    np.testing.assert_allclose(sol.members.item.diode.v[0], [diode_voltage(V) for V in VOLTAGES], rtol=1e-9)
