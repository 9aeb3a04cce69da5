"""Ideal diodes, switches and the switched bridge, against closed forms."""

import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig
from scipy.optimize import brentq

from acausal import Component, Connections, Scalar, connect, simulate
from components import blocks, electrical

pytestmark = pytest.mark.slow

TIGHT = 1e-10


def times_of(solution: Any, name: str) -> np.ndarray:
    times = np.asarray(solution.events.times)
    return np.array([time for time, here in zip(times, solution.events.names, strict=False) if here == name])


def wire_half(sine: Any, source: Any, diode: Any, resistor: Any, coil: Any, ground: Any) -> Connections:
    return (
        connect(sine.y, source.u),
        connect(source.p, diode.p),
        connect(diode.n, resistor.p),
        connect(resistor.n, coil.p),
        connect(coil.n, source.n, ground.p),
    )


def test_half_wave_rectifier_with_coil() -> None:
    """It conducts from v = Vknee on, and blocks where the current of the closed form has come back to what leaks."""
    V, omega, R, L, knee, Goff = 10.0, 2.0 * math.pi, 2.0, 0.5, 0.7, 1e-5
    parts = (
        blocks.Sine(amplitude=V, frequency=1.0),
        electrical.SignalVoltage(),
        electrical.IdealDiode(Ron=0.0, Goff=Goff, Vknee=knee),
        electrical.Resistor(R=R),
        electrical.Inductor(L=L),
        electrical.Ground(),
    )
    # The voltage of the blocking diode is that of what leaks, which has to be resolved.
    sizes = {"parts[4].i": 1e-9}
    rig = Rig(parts=parts, wiring=wire_half)
    solution = simulate(rig, 1.9, save=jnp.array([0.3, 1.4]), rtol=TIGHT, nominal=sizes)
    impedance, phase = math.hypot(R, omega * L), math.atan2(omega * L, R)

    def current(t: float, start: float) -> float:
        forced = lambda t: V / impedance * math.sin(omega * t - phase) - knee / R  # noqa: E731
        return forced(t) + (leak - forced(start)) * math.exp(-R / L * (t - start))

    leak = Goff * knee
    slope = omega * math.sqrt(V**2 - knee**2)
    start = math.asin((knee + R * leak + L * Goff * slope) / V) / omega
    stop = float(brentq(lambda t: current(t, start) - leak, 0.45, 0.95, xtol=1e-14))  # pyright: ignore[reportArgumentType]
    np.testing.assert_allclose(times_of(solution, "parts[2].conduct"), [start, start + 1.0], atol=1e-8)
    np.testing.assert_allclose(times_of(solution, "parts[2].block"), [stop, stop + 1.0], atol=1e-8)
    np.testing.assert_allclose(solution.parts[4].i, [current(0.3, start), current(0.4, start)], atol=1e-8)


def wire_resistive(sine: Any, source: Any, diode: Any, resistor: Any, ground: Any) -> Connections:
    return (
        connect(sine.y, source.u),
        connect(source.p, diode.p),
        connect(diode.n, resistor.p),
        connect(resistor.n, source.n, ground.p),
    )


def test_a_diode_blocks_currents_of_any_size() -> None:
    """From 1e-16 A upwards, with conductances and hysteresis in proportion to the load."""
    share = 1e-6

    def voltages(V: Scalar, R: Scalar) -> Scalar:
        parts = (
            blocks.Sine(amplitude=V, frequency=1.0),
            electrical.SignalVoltage(),
            electrical.IdealDiode(Ron=share * R, Goff=share / R, i_near=1e-9 * V / R, v_near=1e-9 * V),
            electrical.Resistor(R=R),
            electrical.Ground(),
        )
        rig = Rig(parts=parts, wiring=wire_resistive)
        return simulate(rig, 1.0, save=jnp.array([0.25, 0.75])).parts[3].v / V

    draw = np.random.default_rng(0)
    V, R = 10.0 ** draw.uniform(-4.0, 3.0, 32), 10.0 ** draw.uniform(-3.0, 12.0, 32)
    found = jax.jit(jax.vmap(voltages))(V, R)
    np.testing.assert_allclose(found, [[1.0 / (1.0 + share), -share / (1.0 + share)]] * 32, rtol=1e-9)


def test_six_diode_rectifier() -> None:
    """The mean of the output of a three-phase bridge is 3 sqrt(3) V / pi; commutations are 60 degrees apart."""
    rectifier = Rectifier(
        sines=tuple(blocks.Sine(amplitude=100.0, frequency=50.0, phase=-2.0 * math.pi * k / 3.0) for k in range(3)),
        sources=tuple(electrical.SignalVoltage() for _ in range(3)),
        upper=tuple(electrical.IdealDiode(Ron=1e-6, Goff=1e-6) for _ in range(3)),
        lower=tuple(electrical.IdealDiode(Ron=1e-6, Goff=1e-6) for _ in range(3)),
        load=electrical.Resistor(R=10.0),
    )
    grid = (np.arange(240) + 0.5) * 0.02 / 240
    solution = simulate(rectifier, 0.02, save=jnp.asarray(grid), rtol=1e-8)
    phases = 100.0 * np.sin(100.0 * np.pi * grid[:, None] - 2.0 * np.pi * np.arange(3) / 3.0)
    np.testing.assert_allclose(solution.load.v, phases.max(1) - phases.min(1), atol=5e-3)
    found = np.sort(np.concatenate([times_of(solution, f"upper[{k}].conduct") for k in range(3)]))
    np.testing.assert_allclose(found[-3:], np.array([1.0, 5.0, 9.0]) / 600.0, atol=1e-6)


class Rectifier(Component):
    """Three phases in star, six diodes, a resistor."""

    sines: tuple[blocks.Sine, ...]
    sources: tuple[electrical.SignalVoltage, ...]
    upper: tuple[electrical.IdealDiode, ...]
    lower: tuple[electrical.IdealDiode, ...]
    load: electrical.Resistor
    ground: electrical.Ground = electrical.Ground()

    def connections(self) -> Connections:
        rows = list(zip(self.sines, self.sources, self.upper, self.lower, strict=True))
        return (
            *(connect(sine.y, source.u) for sine, source, _, _ in rows),
            *(connect(source.p, upper.p, lower.n) for _, source, upper, lower in rows),
            connect(self.ground.p, *(source.n for source in self.sources)),
            connect(self.load.p, *(upper.n for upper in self.upper)),
            connect(self.load.n, *(lower.p for lower in self.lower)),
        )


class Smoothed(Component):
    """A half-wave rectifier that charges a capacitor beside a resistor."""

    sine: blocks.Sine
    source: electrical.SignalVoltage
    diode: electrical.IdealDiode
    resistor: electrical.Resistor
    capacitor: electrical.Capacitor
    ground: electrical.Ground = electrical.Ground()

    def connections(self) -> Connections:
        return (
            connect(self.sine.y, self.source.u),
            connect(self.source.p, self.diode.p),
            connect(self.diode.n, self.resistor.p, self.capacitor.p),
            connect(self.resistor.n, self.capacitor.n, self.source.n, self.ground.p),
        )


def test_current_that_charges_a_capacitor_through_a_small_resistance() -> None:
    """Its peak and where it ends, by the closed form of the circuit that conducts, from 1 ohm to 1e-6 ohm."""
    V, omega = 10.0, 10.0 * math.pi
    for Ron, C in ((1e-6, 1e-6), (1e-6, 1e-2), (1e-4, 1e-3), (1e-3, 1e-3), (1e-2, 1e-3), (0.1, 1e-2), (1.0, 1e-4)):
        R = 0.1 / C
        model = Smoothed(
            sine=blocks.Sine(amplitude=V, frequency=5.0),
            source=electrical.SignalVoltage(),
            diode=electrical.IdealDiode(Ron=Ron),
            resistor=electrical.Resistor(R=R),
            capacitor=electrical.Capacitor(C=C),
        )
        run = simulate(model, 0.19, peaks=lambda s: s.diode.i)
        rate = (1.0 / R + 1.0 / Ron) / C
        scale = V / (Ron * C) / (rate**2 + omega**2)

        def current(t: np.ndarray, C: float = C, R: float = R, rate: float = rate, scale: float = scale) -> np.ndarray:
            fade, sine, cosine = omega * np.exp(-rate * t), np.sin(omega * t), np.cos(omega * t)
            v = rate * sine - omega * cosine + fade
            return scale * (v / R + C * (omega * (rate * cosine + omega * sine) - rate * fade))

        end = float(brentq(current, 0.03, 0.12))  # pyright: ignore[reportArgumentType]
        top = current(np.linspace(1e-4, 0.09, 10_001)).max()
        np.testing.assert_allclose(times_of(run, "diode.block"), [end], atol=1e-5)
        np.testing.assert_array_equal(len(times_of(run, "diode.conduct")), 1)
        np.testing.assert_allclose(run.peaks.value, top, rtol=1e-4)


class Contacts(Component):
    """A voltage on four resistors, behind a closing, an opening and a commuting switch."""

    pulse: blocks.Pulse
    supply: electrical.ConstantVoltage
    closing: electrical.IdealClosingSwitch
    opening: electrical.IdealOpeningSwitch
    commuting: electrical.IdealCommutingSwitch
    loads: tuple[electrical.Resistor, ...]
    ground: electrical.Ground = electrical.Ground()

    def connections(self) -> Connections:
        ends = (self.closing.n, self.opening.n, self.commuting.n1, self.commuting.n2)
        return (
            connect(self.pulse.y, self.closing.u, self.opening.u, self.commuting.u),
            connect(self.supply.p, self.closing.p, self.opening.p, self.commuting.p),
            connect(self.supply.n, self.ground.p, *(load.n for load in self.loads)),
            *(connect(end, load.p) for end, load in zip(ends, self.loads, strict=True)),
        )


def test_contacts_follow_their_signal() -> None:
    contacts = Contacts(
        pulse=blocks.Pulse(amplitude=1.0, period=1.0, start_time=0.25),
        supply=electrical.ConstantVoltage(V=6.0),
        closing=electrical.IdealClosingSwitch(Ron=1.0, Goff=0.0),
        opening=electrical.IdealOpeningSwitch(Ron=1.0, Goff=0.0),
        commuting=electrical.IdealCommutingSwitch(Ron=1.0, Goff=0.0),
        loads=tuple(electrical.Resistor(R=2.0) for _ in range(4)),
    )
    solution = simulate(contacts, 2.0, save=jnp.array([0.1, 0.5, 1.0, 1.5]), rtol=TIGHT)
    high = np.array([0.0, 2.0, 0.0, 2.0])
    for load, expected in zip(solution.loads, [high, 2.0 - high, 2.0 - high, high], strict=True):
        np.testing.assert_allclose(load.i, expected, atol=1e-10)


def wire_bridge(duty: Any, supply: Any, bridge: Any, resistor: Any, coil: Any, ground: Any) -> Connections:
    return (
        connect(duty.y, bridge.duty),
        connect(supply.p, bridge.p1),
        connect(supply.n, bridge.n1, bridge.n2, ground.p),
        connect(bridge.p2, resistor.p),
        connect(resistor.n, coil.p),
        connect(coil.n, bridge.n2),
    )


def test_bridge_ripples_about_its_average() -> None:
    """With a duty of -0.4, period by period: i rises towards -V/R for 0.4 T, and falls towards 0 for 0.6 T."""
    V, R, L, T, duty, Ron = 12.0, 2.0, 0.01, 1e-3, -0.4, 0.1
    parts = (
        blocks.Constant(k=duty),
        electrical.ConstantVoltage(V=V),
        electrical.HBridge(frequency=1.0 / T, Ron=Ron),
        electrical.Resistor(R=R),
        electrical.Inductor(L=L),
        electrical.Ground(),
    )
    ends = np.array([0.4, 1.0, 1.4, 2.0, 2.4, 3.0]) * T
    solution = simulate(Rig(parts=parts, wiring=wire_bridge), 3.5 * T, save=jnp.asarray(ends), rtol=TIGHT)
    r, i, expected = R + 2.0 * Ron, 0.0, []
    for _ in range(3):
        i = -V / r + (i + V / r) * math.exp(-r / L * 0.4 * T)
        expected.append(i)
        i = i * math.exp(-r / L * 0.6 * T)
        expected.append(i)
    np.testing.assert_allclose(solution.parts[4].i, expected, atol=1e-8)
