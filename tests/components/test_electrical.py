"""Circuits and the motor against closed forms."""

import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Connections, connect, simulate
from components.blocks import Sine, Step
from components.electrical import (
    Capacitor,
    ConstantVoltage,
    CurrentSensor,
    DCMotor,
    Ground,
    Inductor,
    PowerSensor,
    Resistor,
    SignalVoltage,
    VoltageSensor,
)
from components.rotational import SignalTorque


class MotorRig(Component):
    """A motor on a constant voltage, with a load torque that comes later."""

    supply: ConstantVoltage
    motor: DCMotor
    step: Step
    load: SignalTorque = SignalTorque()
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.supply.p, self.motor.p),
            connect(self.supply.n, self.motor.n, self.ground.p),
            connect(self.motor.shaft, self.load.flange),
            connect(self.step.y, self.load.u),
        )


@pytest.mark.thorough
def test_motor_step_and_load() -> None:
    """The DC motor of ModelingToolkitStandardLibrary's tests; transients by the exponential of its 2 x 2 matrix."""
    R, L, k, J, C, V, T = 0.5, 4.5e-3, 0.5, 0.02, 0.01, 10.0, 3.0
    rig = MotorRig(
        supply=ConstantVoltage(V=V),
        motor=DCMotor(R=R, L=L, k=k, J=J, friction=C),
        step=Step(height=-T, start_time=3.0),
    )
    expected = np.array(
        [
            [0.01, 12.8165929508, 1.9360195936],
            [0.02, 14.9423638225, 5.5177152272],
            [0.05, 7.9335941903, 14.1889288270],
            [0.1, 1.6644979122, 18.7685932777],
            [0.2, 0.4186998205, 19.5906175477],
            [2.9, C * V / (k**2 + C * R), k * V / (k**2 + C * R)],
            [3.01, 0.9729627410, 18.1645308612],
            [3.05, 4.6488355109, 14.8348019352],
            [3.5, 6.2745097616, 13.7254902235],
            [6.0, (C * V + k * T) / (k**2 + C * R), (k * V - R * T) / (k**2 + C * R)],
        ]
    )
    sol = simulate(rig, 6.0, save=jnp.asarray(expected[:, 0]), rtol=1e-9)
    np.testing.assert_allclose(sol["motor.inductor.i"], expected[:, 1], rtol=1e-6)
    np.testing.assert_allclose(sol["motor.rotor.w"], expected[:, 2], rtol=1e-6)


class SensedCircuit(Component):
    """R, L and C in series on a sine, with sensors."""

    resistor: Resistor
    inductor: Inductor
    capacitor: Capacitor
    sine: Sine
    source: SignalVoltage = SignalVoltage()
    ammeter: CurrentSensor = CurrentSensor()
    voltmeter: VoltageSensor = VoltageSensor()
    wattmeter: PowerSensor = PowerSensor()
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.sine.y, self.source.u),
            connect(self.source.p, self.wattmeter.p),
            connect(self.wattmeter.n, self.ammeter.p),
            connect(self.ammeter.n, self.resistor.p),
            connect(self.resistor.n, self.inductor.p),
            connect(self.inductor.n, self.capacitor.p, self.voltmeter.p),
            connect(self.capacitor.n, self.voltmeter.n, self.source.n, self.wattmeter.reference, self.ground.p),
        )


@pytest.mark.thorough
def test_series_resonance_and_sensors() -> None:
    """The stationary oscillation by complex impedance, after 40 time constants."""
    R, L, C, f = 2.0, 0.1, 0.02, 1.3
    rig = SensedCircuit(
        resistor=Resistor(R=R),
        inductor=Inductor(L=L),
        capacitor=Capacitor(C=C),
        sine=Sine(amplitude=5.0, frequency=f),
    )
    times = np.linspace(4.0, 5.0, 11)
    sol = simulate(rig, 5.0, save=jnp.asarray(times), rtol=1e-9)
    s = 2j * np.pi * f
    current = 5.0 / (R + s * L + 1.0 / (s * C))
    i = np.imag(current * np.exp(s * times))
    np.testing.assert_allclose(sol["ammeter.y.value"], i, atol=1e-6)
    np.testing.assert_allclose(sol["voltmeter.y.value"], np.imag(current / (s * C) * np.exp(s * times)), atol=1e-6)
    np.testing.assert_allclose(sol["wattmeter.y.value"], 5.0 * np.sin(2 * np.pi * f * times) * i, atol=1e-5)
