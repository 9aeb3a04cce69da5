"""Simultaneous equations left to the integrator: M dy/dt = f(t, y)."""

from typing import Any, Self

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _models import rectifier
from test_evaluate import bridge

from acausal import (
    Component,
    Connections,
    Discrete,
    Equations,
    Events,
    ModelError,
    Param,
    Rodas3P,
    Scalar,
    Var,
    choose_states,
    connect,
    eq,
    prefer,
    simulate,
    when,
)
from components.blocks import Pulse, Sine
from components.electrical import (
    Capacitor,
    Ground,
    IdealClosingSwitch,
    IdealDiode,
    Inductor,
    Resistor,
    SignalVoltage,
)

TIMES = np.linspace(0.0, 0.3, 4)


@pytest.mark.thorough
@pytest.mark.parametrize(("name", "make"), [("diode", lambda: rectifier(5.0)), ("arms", bridge)])
def test_both_forms_agree(name: str, make: Any) -> None:
    solved, integrated = choose_states(make()), choose_states(make(), algebraic="integrate")
    assert solved.mass is None
    assert integrated.mass is not None
    np.testing.assert_array_equal(integrated.mass[:1], [1.0])
    np.testing.assert_array_equal(integrated.mass[1:], 0.0)
    assert len(integrated.mass) > 1
    a, b = (simulate(make(), 0.3, save=TIMES, rtol=1e-10, system=system) for system in (solved, integrated))
    np.testing.assert_allclose(a["c.v"], b["c.v"], rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(a["c.i"], b["c.i"], rtol=1e-6, atol=1e-9)


def test_solvers_for_ordinary_equations_are_refused() -> None:
    system = choose_states(rectifier(5.0), algebraic="integrate")
    with pytest.raises(ModelError, match=r"Rodas5P or Rodas3P; Kvaerno5 integrates ODEs only"):
        simulate(rectifier(5.0), 0.3, system=system, solver=diffrax.Kvaerno5())


@pytest.mark.thorough
def test_the_smaller_rosenbrock_method() -> None:
    system = choose_states(bridge(), algebraic="integrate")
    sol = simulate(bridge(), 0.3, save=TIMES, rtol=1e-8, system=system, solver=Rodas3P())
    # The resistance that the capacitor sees decides its time constant; its end value is that of the open bridge.
    a, b, c, d = 3.0, 5.0, 7.0, 2.0
    star = np.array([[1 / 1.5 + 1 / a + 1 / b, -1 / a, -1 / b], [-1 / a, 1 / a + 1 / c, 0], [-1 / b, 0, 1 / b + 1 / d]])
    probe = np.array([0.0, 1.0, -1.0])
    resistance = probe @ np.linalg.solve(star, probe)
    final = probe @ np.linalg.solve(star, [12.0 / 1.5, 0.0, 0.0])
    expected = final * (1.0 - np.exp(-TIMES / (resistance * 0.1)))
    np.testing.assert_allclose(sol["c.v"], expected, rtol=1e-6, atol=1e-8)


class Watched(Component):
    """Events that read what nonlinear equations determine, and set the rate of the state to it."""

    k: Param[Scalar, "1/s"]
    x: Var[Scalar, "1", prefer] = 1.0
    y: Var[Scalar, "1"] = 0.5
    z: Var[Scalar, "1"] = 0.5
    u: Var[Scalar, "1"] = 0.5
    seen: Discrete[Scalar, "1"] = 0.0
    gain: Discrete[Scalar, "1"] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(
            decay=eq(d.x, -self.k * self.gain * self.u),
            cube=eq(self.y + self.y**3, self.x),
            first=eq(self.z + 0.3 * self.u**3, self.y),
            second=eq(self.u + 0.3 * self.z**3, self.x),
        )

    def events(self) -> Events:
        return dict(low=when(self.u < 0.8, seen=self.y, gain=1.0 + self.z))


@pytest.mark.thorough
def test_events_and_stops_by_algebraic_unknowns() -> None:
    """In both forms at rates that differ: all happens at the same k t, whatever k is."""
    system = choose_states(Watched(k=1.0), algebraic="integrate")
    assert np.sum(system.mass == 0.0) == 2

    def found(k: Scalar, system: Any) -> Any:
        sol = simulate(Watched(k=k), 9.0, system=system, until=lambda s: s.u - 0.4, rtol=1e-9, save="end")
        return jnp.stack([k * sol.t1, k * sol.events.times[0], sol.final.u, sol.final.seen, sol.final.gain])

    one = found(1.0, None)
    other, slope = jax.jvp(lambda k: found(k, system), (2.0,), (1.0,))
    np.testing.assert_allclose(other, one, rtol=1e-7)
    np.testing.assert_allclose(other[2], 0.4, rtol=1e-8)
    np.testing.assert_allclose(slope, np.zeros(5), atol=1e-6)


class Coupled(Component):
    """y = x/(1 - k^2) by two equations, whose coefficient k changes when x has fallen to a level."""

    level: Param[Scalar, "1"] = 0.5
    x: Var[Scalar, "1", prefer] = 1.0
    y: Var[Scalar, "1"] = 0.0
    z: Var[Scalar, "1"] = 0.0
    k: Discrete[Scalar, "1"] = 0.5

    def equations(self, d: Self) -> Equations:
        return dict(
            decay=eq(d.x, -self.y, check_units=False),
            first=eq(self.y + self.k * self.z, self.x),
            second=eq(self.z + self.k * self.y, 0.0),
        )

    def events(self) -> Events:
        return dict(low=when(self.x < self.level, k=0.8))


@pytest.mark.thorough
def test_residuals_hold_in_the_modes_of_the_moment() -> None:
    """x decays with the rate 1/(1 - k^2), from the level on with that of the second k; and the derivative."""
    system = choose_states(Coupled(), algebraic="integrate")
    assert system.n_algebraic > 0

    def end(level: Scalar) -> Scalar:
        return simulate(Coupled(level=level), 1.0, save="end", rtol=1e-9, system=system).final.x

    def exact(level: Scalar) -> Scalar:
        return level * jnp.exp(-(1.0 + 0.75 * jnp.log(level)) / 0.36)

    value, slope = jax.jvp(end, (0.6,), (1.0,))
    np.testing.assert_allclose(value, exact(0.6), rtol=1e-7)
    np.testing.assert_allclose(slope, jax.grad(exact)(0.6), rtol=1e-6)


class HalfWave(Component):
    """A sine behind a diode and a resistor, which feeds a store with a load beside it."""

    sine: Sine
    diode: IdealDiode
    resistor: Resistor
    store: Capacitor | Inductor | Resistor
    load: Resistor
    source: SignalVoltage = SignalVoltage()
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.sine.y, self.source.u),
            connect(self.source.p, self.diode.p),
            connect(self.diode.n, self.resistor.p),
            connect(self.resistor.n, self.store.p, self.load.p),
            connect(self.store.n, self.load.n, self.source.n, self.ground.p),
        )


def half_wave(store: Capacitor | Inductor | Resistor) -> HalfWave:
    return HalfWave(
        sine=Sine(amplitude=5.0, frequency=5.0),
        diode=IdealDiode(Ron=0.1, Goff=1e-4, Vknee=0.7),
        resistor=Resistor(R=2.0),
        store=store,
        load=Resistor(R=10.0),
    )


class Switched(Component):
    """A contact that a pulse closes again and again, between a sine and two resistors."""

    sine: Sine
    pulse: Pulse
    contact: IdealClosingSwitch
    first: Resistor
    second: Resistor
    source: SignalVoltage = SignalVoltage()
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.sine.y, self.source.u),
            connect(self.pulse.y, self.contact.u),
            connect(self.source.p, self.first.p),
            connect(self.first.n, self.contact.p, self.second.p),
            connect(self.contact.n, self.second.n, self.source.n, self.ground.p),
        )


def switched() -> Switched:
    return Switched(
        sine=Sine(amplitude=5.0, frequency=5.0),
        pulse=Pulse(amplitude=1.0, period=0.1, width=0.3),
        contact=IdealClosingSwitch(Ron=0.1, Goff=1e-4),
        first=Resistor(R=2.0),
        second=Resistor(R=3.0),
    )


@pytest.mark.parametrize(
    ("model", "read"),
    [
        (half_wave(Capacitor(C=0.01)), "store.v"),
        pytest.param(half_wave(Inductor(L=0.05)), "store.i", marks=pytest.mark.slow),
        (half_wave(Resistor(R=5.0)), "store.i"),
        pytest.param(switched(), "second.i", marks=pytest.mark.slow),
    ],
    ids=["capacitor", "coil", "no state", "contact"],
)
def test_circuits_whose_modes_change(model: Component, read: str) -> None:
    """With and without states, both forms find the same events, and the same values between steps."""
    integrated = choose_states(model, algebraic="integrate")
    assert integrated.n_algebraic > 0
    times = np.linspace(0.0, 0.37, 12)
    a, b = (simulate(model, 0.37, save=times, rtol=1e-9, system=system) for system in (None, integrated))
    assert len(a.events.names) > 3
    assert a.events.names == b.events.names
    np.testing.assert_allclose(a.events.times, b.events.times, rtol=1e-6)
    np.testing.assert_allclose(b[read], a[read], rtol=1e-5, atol=1e-7)
