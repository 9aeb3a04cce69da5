"""Constraints between states: what is differentiated, and that the result is right."""

import numpy as np
import pytest
from _mechanisms import Pendulum, driven_capacitor
from _models import gear_train
from scipy.integrate import quad
from scipy.special import ellipj, ellipk

from acausal import Component, Connections, choose_states, connect, simulate, structure
from components.electrical import Capacitor, Ground, Resistor


def test_gear_makes_one_inertia_dependent() -> None:
    report = structure(gear_train(-3.0))
    assert len(report.states) == 2
    assert report.differentiated == {"gear.kinematics": 2, "first.speed": 1, "second.speed": 1}
    assert len(report.dummies) == 4  # an angle's two derivatives, and the derivative of each speed that is not a state


@pytest.mark.thorough
def test_capacitor_across_a_given_voltage() -> None:
    """No state is left: the currents follow from the source's slope."""
    amplitude, frequency = 3.0, 2.0
    report = structure(driven_capacitor())
    assert report.states == {}
    assert report.differentiated["signal.sine"] == 1
    times = np.linspace(0.0, 0.7, 8)
    sol = simulate(driven_capacitor(amplitude, frequency), 0.7, save=times)
    omega = 2.0 * np.pi * frequency
    slope = amplitude * omega * np.cos(omega * times)
    np.testing.assert_allclose(sol["c.i"], 0.02 * slope, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(sol["twin.i"], 0.05 * slope, rtol=1e-12, atol=1e-13)
    current = 0.07 * slope + amplitude * np.sin(omega * times) / 10.0
    np.testing.assert_allclose(sol["source.i"], -current, rtol=1e-12, atol=1e-13)


class Loop(Component):
    """Two capacitors in parallel, discharged by a resistor."""

    a: Capacitor
    b: Capacitor
    r: Resistor
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return connect(self.a.p, self.b.p, self.r.p), connect(self.a.n, self.b.n, self.r.n, self.ground.p)


@pytest.mark.thorough
def test_loop_of_capacitors() -> None:
    """The two have one voltage, which is one state; the start value given for one holds for both."""
    model = Loop(a=Capacitor(C=1e-3), b=Capacitor(C=3e-3, v=2.0), r=Resistor(R=50.0))
    assert len(structure(model).states) == 1
    sol = simulate(model, 0.1, save="end", rtol=1e-10)
    np.testing.assert_allclose(sol.final.a.v, 2.0 * np.exp(-0.1 / (50.0 * 4e-3)), rtol=1e-9)
    np.testing.assert_allclose(sol.final.b.i, 3.0 * sol.final.a.i, rtol=1e-12)


def angle(t: float, g: float = 9.81) -> float:
    """The angle of a pendulum of 1 m released at rest from the horizontal: sin(angle/2) = k sn(K - w t)."""
    k2 = np.sin(np.pi / 4) ** 2
    return 2.0 * np.arcsin(np.sqrt(k2) * ellipj(ellipk(k2) - np.sqrt(g) * t, k2)[0])


def test_exact_pendulum() -> None:
    """The elliptic function against the integral of energy, t = integral of d angle / sqrt(2 g cos(angle))."""
    end = angle(0.5)
    # Near the horizontal, with cos(angle) = s^2, the integrand is smooth in s.
    time, _ = quad(lambda s: 2.0 / np.sqrt(2.0 * 9.81 * (1.0 - s**4)), 0.0, np.sqrt(np.cos(end)))
    np.testing.assert_allclose(time, 0.5, rtol=1e-9)


@pytest.mark.thorough
def test_planar_pendulum() -> None:
    model = Pendulum(x=1.0, y=0.0)
    system = choose_states(model)
    report = structure(system)
    assert report.differentiated["rod"] == 2
    assert report.invariants == ("rod", "d/dt rod")
    assert set(report.states) == {"x", "y", "u", "v"}
    sol = simulate(model, 0.5, rtol=1e-9, system=system)
    np.testing.assert_allclose(np.array([sol.final.x, sol.final.y]), [0.391048791551, -0.920369948785], rtol=1e-8)
    angles = np.array([angle(t) for t in np.asarray(sol.ts)])
    np.testing.assert_allclose(sol.x, np.sin(angles), rtol=1e-8)
    np.testing.assert_allclose(sol.y, -np.cos(angles), rtol=1e-8, atol=1e-9)
    # Of the whole motion only the rod's constraint is stated; its derivatives hold too.
    np.testing.assert_allclose(sol.x * sol.u + sol.y * sol.v, 0.0, atol=1e-12)
    # The rod carries the weight and the centripetal force, 3 g cos(angle).
    np.testing.assert_allclose(sol.force, 3.0 * 9.81 * np.cos(angles), rtol=1e-7, atol=1e-8)
