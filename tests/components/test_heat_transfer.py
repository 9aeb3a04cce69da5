"""Convection, radiation and the brake that heats up, against closed forms."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig

from acausal import Connections, connect, simulate
from components import blocks, rotational, thermal

TIMES = jnp.linspace(0.0, 1.0, 6)


def wire_brake(motion: Any, brake: Any, heat: Any) -> Connections:
    return connect(motion.flange, brake.flange), connect(brake.heat, heat.port)


@pytest.mark.parametrize(("w", "T", "torque"), [(10.0, 293.15, 7.0), (-20.0, 293.15, -5.6), (13.92, 393.15, 7.0)])
def test_eddy_current_brake(w: float, T: float, torque: float) -> None:
    """Its largest torque is at w_nominal; a hot disc of copper has it at a speed that is higher by its resistance."""
    brake = rotational.EddyCurrentBrake(tau_nominal=7.0, w_nominal=10.0)
    parts = (rotational.ConstantSpeed(speed=w), brake, thermal.FixedTemperature(temperature=T))
    end = simulate(Rig(parts=parts, wiring=wire_brake), 0.1, save="end").final.parts
    np.testing.assert_allclose(end[1].flange.tau, torque, rtol=1e-9)
    np.testing.assert_allclose(end[2].port.Q_flow, torque * w, rtol=1e-9)


def test_eddy_current_brake_refers_to_its_own_temperature() -> None:
    """With T_ref = 393.15 K, w_nominal is the speed at that temperature."""
    brake = rotational.EddyCurrentBrake(tau_nominal=7.0, w_nominal=13.92, T_ref=393.15)
    parts = (rotational.ConstantSpeed(speed=10.0), brake, thermal.FixedTemperature(temperature=293.15))
    end = simulate(Rig(parts=parts, wiring=wire_brake), 0.1, save="end").final.parts
    np.testing.assert_allclose(end[1].flange.tau, 7.0, rtol=1e-12)


def wire_heat(body: Any, transfer: Any, room: Any, temperature: Any, coefficient: Any, sensor: Any) -> Connections:
    return (
        connect(body.port, transfer.solid, sensor.a),
        connect(transfer.fluid, room.port, sensor.b),
        connect(temperature.y, room.u),
        connect(coefficient.y, transfer.u),
    )


@pytest.mark.thorough
def test_convection_to_a_room_that_warms_up() -> None:
    """C dT/dt = -G (T - T_room) with T_room = 280 + 2 t: the difference tends to -2 C / G."""
    parts = (
        thermal.HeatCapacitor(C=4.0, T=300.0),
        thermal.Convection(),
        thermal.SignalTemperature(),
        blocks.Ramp(height=20.0, duration=10.0, offset=280.0),
        blocks.Constant(k=2.0),
        thermal.RelativeTemperatureSensor(),
    )
    solution = simulate(Rig(parts=parts, wiring=wire_heat), 4.0, save=4.0 * TIMES, rtol=1e-9)
    exact = -4.0 + 24.0 * np.exp(-2.0 * np.asarray(TIMES))
    np.testing.assert_allclose(solution["parts[5].y.value"], exact, atol=1e-6)


def wire_radiation(body: Any, transfer: Any, room: Any) -> Connections:
    return connect(body.port, transfer.a), connect(transfer.b, room.port)


def test_radiation_into_space() -> None:
    """C dT/dt = -Gr sigma T^4: T^-3 = T0^-3 + 3 Gr sigma t / C."""
    parts = (
        thermal.HeatCapacitor(C=100.0, T=900.0),
        thermal.BodyRadiation(Gr=0.2),
        thermal.FixedTemperature(temperature=2.7),
    )
    end = simulate(Rig(parts=parts, wiring=wire_radiation), 60.0, save="end", rtol=1e-9).final.parts
    exact = (900.0**-3 + 3.0 * 0.2 * 5.670374419e-8 * 60.0 / 100.0) ** (-1.0 / 3.0)
    np.testing.assert_allclose(end[0].T, exact, rtol=1e-8)
