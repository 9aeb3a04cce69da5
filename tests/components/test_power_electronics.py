"""Three-phase bridges: spectra of modulation, mean voltages, dead time and losses against closed forms."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig
from scipy.special import jv

from acausal import Connections, ParameterError, Solution, connect, linearise, simulate
from acausal.testing import check_law
from components import blocks, electrical
from components.electrical import Ground, HalfBridge, Inductor, PhaseImpedance, Resistor, StarPoint

V = 100.0


def one_leg(source: Any, leg: Any, duty: Any, ground: Any) -> Connections:
    return (
        connect(source.p, leg.p),
        connect(source.n, leg.n, ground.p),
        connect(duty.y, leg.duty),
    )


def edges(solution: Solution, name: str) -> np.ndarray:
    log = solution.events
    return np.array([t for t, event in zip(log.times, log.names, strict=True) if event == name])


@pytest.mark.thorough
def test_the_spectrum_of_regular_sampled_pulses_is_that_of_bessel_functions() -> None:
    """Holmes, Lipo, `Pulse Width Modulation for Power Converters`, sec. 3.6: symmetric regular sampling.

    The harmonic k of the fundamental has q = k f0/fc, and each multiple m of the carrier adds its sideband k - m fc/f0:
    (2 V/(pi q)) J_n(q pi M/2) sin((q + n) pi/2).
    """
    f0, ratio, M = 50.0, 9, 0.8
    parts = (
        electrical.ConstantVoltage(V=V),
        HalfBridge(frequency=f0 * ratio),
        blocks.Sine(amplitude=0.5 * M, frequency=f0, phase=0.5 * np.pi, offset=0.5),
        Ground(),
    )
    solution = simulate(Rig(parts=parts, wiring=one_leg), 1.2 / f0, max_events=100)
    rises, falls = edges(solution, "parts[1].lower_off"), edges(solution, "parts[1].upper_off")
    rises, falls = rises[rises < 1.0 / f0], falls[falls < 1.0 / f0]
    assert len(rises) == len(falls) == ratio
    sidebands = np.arange(-40, 41)
    for k in (1, 2, 7, 8, 9, 10, 11, 17, 19):
        w, q = 2.0 * np.pi * f0 * k, k / ratio
        found = abs(np.sum(np.exp(-1j * w * rises) - np.exp(-1j * w * falls)) / (1j * w) * f0) * 2.0 * V
        n = k - ratio * sidebands
        expected = 2.0 * V / (np.pi * q) * abs(np.sum(jv(n, 0.5 * np.pi * q * M) * np.sin(0.5 * np.pi * (q + n))))
        assert found == pytest.approx(expected, abs=1e-9 * V)


def six_steps(source: Any, inverter: Any, load: Any, star: Any, ground: Any, *sines: Any) -> Connections:
    return (
        connect(source.p, inverter.p),
        connect(source.n, inverter.n, ground.p),
        connect(inverter.phases, load.p),
        connect(load.n, star.phases),
        *(connect(sine.y, u) for sine, u in zip(sines, (inverter.u_a, inverter.u_b, inverter.u_c), strict=True)),
    )


def sines(amplitude: float, f: float, phase: float) -> tuple[blocks.Sine, ...]:
    return tuple(blocks.Sine(amplitude=amplitude, frequency=f, phase=phase - 2.0 * np.pi * k / 3.0) for k in range(3))


@pytest.mark.thorough
def test_six_steps_have_the_harmonics_of_six_steps() -> None:
    """The phase voltage has 2/(pi n) of the direct voltage at n = 1, 5, 7, 11, ..., and nothing in between."""
    f, steps = 50.0, 12
    parts = (
        electrical.ConstantVoltage(V=V),
        electrical.PhaseInverter(leg=HalfBridge(frequency=steps * f)),
        PhaseImpedance(R=1.0, L=5e-3),
        StarPoint(),
        Ground(),
        *sines(100.0, f, np.pi / steps),
    )
    t = (np.arange(steps) + 0.5) / (steps * f)
    solution = simulate(Rig(parts=parts, wiring=six_steps), 1.0 / f, save=jnp.asarray(t))
    levels = np.asarray(solution.parts[2].p.v_a - solution.parts[3].n.v)
    np.testing.assert_allclose(np.abs(levels), V * np.tile([1, 1, 2, 2, 1, 1], 2) / 3.0, atol=1e-9)
    for n in range(1, 12):
        w = 2.0 * np.pi * f * n
        harmonic = abs(np.sum(levels * np.exp(-1j * w * t))) * np.sin(0.5 * w / (steps * f)) * 4.0 * f / w
        assert harmonic == pytest.approx(2.0 * V / (np.pi * n) if n in (1, 5, 7, 11) else 0.0, abs=1e-9 * V)


def rectifier(*parts: Any) -> Connections:
    source, line, bridge, coil, load, sensor, area, ground = parts
    return (
        connect(source.phases, line.p),
        connect(line.n, bridge.phases),
        connect(bridge.p, coil.p, sensor.p),
        connect(coil.n, load.p),
        connect(bridge.n, load.n, sensor.n, ground.p),
        connect(sensor.y, area.u),
    )


@pytest.mark.thorough
def test_the_mean_voltage_of_a_diode_bridge() -> None:
    """3 sqrt(3)/pi V, less 3/pi 2 pi f L i while the diodes commutate (Mohan et al., `Power Electronics`, 5-6)."""
    peak, f, L = 325.0, 50.0, 1e-3
    parts = (
        electrical.ThreePhaseSource(V=peak, f=f),
        PhaseImpedance(R=1e-4, L=L),
        electrical.DiodeBridge(),
        Inductor(L=0.2),
        Resistor(R=50.0),
        electrical.VoltageSensor(),
        blocks.Integrator(),
        Ground(),
    )
    t = np.array([0.03, 0.05])
    solution = simulate(Rig(parts=parts, wiring=rectifier), 0.0501, save=jnp.asarray(t))
    mean = np.diff(solution.parts[6].x)[0] * f
    current = float(np.mean(solution["parts[3].i"]))
    assert current > 10.0
    assert mean == pytest.approx(3.0 * np.sqrt(3.0) / np.pi * peak - 6.0 * f * L * current, rel=1e-3)


@pytest.mark.parametrize("averaged", [False, True])
def test_choppers(averaged: bool) -> None:
    data: dict[str, Any] = dict(R=10.0, v_on=700.0, v_off=680.0)
    part: Any
    if averaged:
        part = electrical.AveragedBrakeChopper(**data)
        check_law(part, given={"v": [600.0, 690.0, 800.0]}, expected={"i": [0.0, 34.5, 80.0]})
    else:
        part = electrical.BrakeChopper(**data)
        check_law(part, given={"v": [600.0, 690.0, 800.0]}, expected={"i": [0.0, 0.0, 80.0]})
    with pytest.raises(ParameterError, match="v_off must be smaller than v_on"):
        type(part)(**{**data, "v_off": 700.0})


def test_a_rotating_voltage_is_constant_in_rotor_coordinates() -> None:
    """Phases with the peak 10 V that lead the rotor by 0.3 rad have v_d = 10 cos 0.3 and v_q = 10 sin 0.3."""
    phi = np.array([0.0, 0.4, 2.0])
    angle = [2.0 * phi + 0.3 - 2.0 * np.pi * k / 3.0 for k in range(3)]
    given = {f"phases.v_{x}": 5.0 + 10.0 * np.cos(angle[k]) for k, x in enumerate("abc")} | {"shaft.phi": phi}
    expected = {"machine.v_d": [10.0 * np.cos(0.3)] * 3, "machine.v_q": [10.0 * np.sin(0.3)] * 3, "v_star": [5.0] * 3}
    check_law(electrical.DqTerminals(p=2.0), given=given, expected=expected)


def test_space_vectors_centre_the_pulses() -> None:
    given = {"u_a.value": 0.4, "u_b.value": -0.1, "u_c.value": -0.3}
    law = {"d_a.value": 0.85, "d_b.value": 0.35, "d_c.value": 0.15}
    check_law(electrical.PhaseModulator(), given=given, expected=law)
    law = {"d_a.value": 0.9, "d_b.value": 0.4, "d_c.value": 0.2}
    check_law(electrical.PhaseModulator(space_vector=False), given=given, expected=law)


def filtered(source: Any, coil: Any, capacitor: Any, ground: Any) -> Connections:
    return (
        connect(source.phases, coil.p),
        connect(coil.n, capacitor.phases),
        connect(source.n, ground.p),
    )


def test_an_lc_filter_has_its_resonance_in_the_two_independent_phases() -> None:
    """s^2 L C + s R C + 1 = 0, twice: without a neutral conductor, the third current is minus the sum of the others."""
    R, L, C = 0.5, 2e-3, 10e-6
    parts = (
        electrical.ThreePhaseSource(V=V, f=50.0),
        PhaseImpedance(R=R, L=L),
        electrical.PhaseCapacitor(C=C),
        Ground(),
    )
    poles = np.asarray(linearise(Rig(parts=parts, wiring=filtered)).poles)
    poles = poles[np.abs(poles) > 1.0]  # without the mean voltage of the capacitors, which rests
    expected = np.roots([L * C, R * C, 1.0])
    assert len(poles) == 4
    for pole in poles:
        assert np.min(np.abs(pole - expected)) < 1e-6 * abs(pole)
