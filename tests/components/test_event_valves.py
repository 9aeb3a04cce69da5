"""Valves that open and close by events, and a solenoid valve, against closed forms."""

import math
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig

from acausal import Connections, ParameterError, connect, simulate
from components import blocks, electrical, hydraulic, rotational

pytestmark = pytest.mark.slow

TIGHT = 1e-10


def times_of(solution: Any, name: str) -> np.ndarray:
    times = np.asarray(solution.events.times)
    return np.array([time for time, here in zip(times, solution.events.names, strict=False) if here == name])


def wire_check(sine: Any, source: Any, valve: Any, volume: Any) -> Connections:
    return connect(sine.y, source.u), connect(source.port, valve.a), connect(valve.b, volume.port)


def test_check_valve_charges_a_volume_once() -> None:
    """It opens at asin(p_c / P) / omega; open, T dp/dt = P sin(omega t) - p_c - p; it closes where that is zero."""
    P, omega, cracking, conductance, volume, beta = 5e5, 2.0 * math.pi, 2e4, 1e-9, 1e-3, 1e9
    parts = (
        blocks.Sine(amplitude=P, frequency=1.0),
        hydraulic.SignalPressure(),
        hydraulic.IdealCheckValve(conductance=conductance, cracking_pressure=cracking),
        hydraulic.Volume(volume=volume, bulk_modulus=beta),
    )
    solution = simulate(Rig(parts=parts, wiring=wire_check), 0.8, save=jnp.array([0.2, 0.8]), rtol=TIGHT)
    T = volume / (beta * conductance)
    start = math.asin(cracking / P) / omega
    gain, lag = P / math.hypot(1.0, omega * T), math.atan(omega * T)

    def pressure(t: float) -> float:
        forced = lambda t: gain * math.sin(omega * t - lag) - cracking  # noqa: E731
        return forced(t) - forced(start) * math.exp(-(t - start) / T)

    stop = times_of(solution, "parts[2].close")[0]
    np.testing.assert_allclose(times_of(solution, "parts[2].open")[0], start, atol=1e-8)
    np.testing.assert_allclose(P * math.sin(omega * stop) - cracking, pressure(stop), rtol=1e-6)
    np.testing.assert_allclose(solution.parts[3].p, [pressure(0.2), pressure(stop)], rtol=1e-8)


def wire_relief(flow: Any, volume: Any, valve: Any, tank: Any) -> Connections:
    return connect(flow.port, volume.port, valve.a), connect(valve.b, tank.port)


def test_relief_valve_with_hysteresis_oscillates() -> None:
    """Charging is linear, discharging exponential: both times follow from the cracking and the reseat pressure."""
    q, C, G, high, low = 1e-4, 1e-12, 4e-10, 1e6, 6e5
    parts = (
        hydraulic.ConstantFlow(flow=q),
        hydraulic.Volume(volume=1e-3, bulk_modulus=1e-3 / C),
        hydraulic.SnapReliefValve(conductance=G, cracking_pressure=high, reseat_pressure=low),
        hydraulic.Tank(),
    )
    solution = simulate(Rig(parts=parts, wiring=wire_relief), 0.03, save="end", rtol=TIGHT)
    relieve = C / G * math.log((high - q / G) / (low - q / G))
    opens = C * high / q + np.arange(4) * (relieve + C * (high - low) / q)
    np.testing.assert_allclose(times_of(solution, "parts[2].open"), opens, rtol=1e-8)
    np.testing.assert_allclose(times_of(solution, "parts[2].close"), opens + relieve, rtol=1e-8)


def test_reseat_pressure_is_below_cracking_pressure() -> None:
    with pytest.raises(ParameterError, match=r"SnapReliefValve.reseat_pressure must be smaller"):
        hydraulic.SnapReliefValve(conductance=1.0, cracking_pressure=1.0, reseat_pressure=2.0)


def wire_solenoid(step: Any, source: Any, valve: Any, supply: Any, tank: Any, ground: Any) -> Connections:
    return (
        connect(step.y, source.u),
        connect(source.p, valve.p),
        connect(source.n, valve.n, ground.p),
        connect(supply.port, valve.a),
        connect(valve.b, tank.port),
    )


def test_solenoid_valve_opens_and_closes() -> None:
    """Before it lifts, Psi = L V/R (1 - exp(-R t / L)); it lifts where Psi^2 / (2 L0 g0) is the preload."""
    R, L0, g0, stroke, residual, preload, V = 5.0, 0.1, 2e-4, 5e-4, 5e-5, 8.0, 12.0
    valve = hydraulic.SolenoidValve(
        R=R, L0=L0, g0=g0, m=0.02, spring=2000.0, preload=preload, stroke=stroke, residual_gap=residual,
        area=2e-6, density=850.0, damping=1.0,
    )  # fmt: skip
    parts = (
        blocks.Pulse(amplitude=V, period=0.2, width=0.5),
        electrical.SignalVoltage(),
        valve,
        hydraulic.ConstantPressure(pressure=1e6),
        hydraulic.Tank(),
        electrical.Ground(),
    )
    solution = simulate(Rig(parts=parts, wiring=wire_solenoid), 0.19, save=jnp.array([0.09, 0.19]), rtol=TIGHT)
    L = L0 / (1.0 + (stroke + residual) / g0)
    flux = math.sqrt(2.0 * L0 * g0 * preload)
    lift = -L / R * math.log(1.0 - flux / (L * V / R))
    np.testing.assert_allclose(times_of(solution, "parts[2].stop.lift_low")[0], lift, atol=1e-8)
    full = 0.61 * 2e-6 * math.sqrt(2.0 * 1e6 / 850.0)
    np.testing.assert_allclose(solution.parts[2].valve.q, [full, 0.0], rtol=1e-8, atol=1e-12 * full)
    assert len(times_of(solution, "parts[2].stop.impact_high")) == 1


def wire_pump(ramp: Any, torque: Any, pump: Any, tank: Any, pressure: Any) -> Connections:
    return (
        connect(ramp.y, torque.u),
        connect(torque.flange, pump.shaft),
        connect(pump.a, tank.port),
        connect(pump.b, pressure.port),
    )


def test_pump_breaks_away() -> None:
    """Against D dp it turns when the torque exceeds D dp + Ts; below that speed zero it only leaks."""
    D, dp, Ts, rate = 2e-7, 1e6, 0.3, 1.0
    parts = (
        blocks.Ramp(height=rate, duration=1.0),
        rotational.SignalTorque(),
        hydraulic.StickingPump(displacement=D, J=1e-4, Tc=0.1, Ts=Ts, ws=10.0, friction=1e-3, leakage=1e-13),
        hydraulic.Tank(),
        hydraulic.ConstantPressure(pressure=dp),
    )
    solution = simulate(Rig(parts=parts, wiring=wire_pump), 0.7, save=jnp.array([0.4, 0.7]), rtol=TIGHT)
    # At the start the pressure alone, 0.2 N.m, does not turn it back.
    np.testing.assert_allclose(times_of(solution, "parts[2].bearing.forward"), [(D * dp + Ts) / rate], atol=1e-8)
    np.testing.assert_allclose(solution.parts[2].pump.q[0], -1e-13 * dp, rtol=1e-6)
    assert solution.parts[2].pump.w[1] > 100.0
