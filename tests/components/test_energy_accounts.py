"""Every component: power through its ports + supplied = d(stored)/dt + dissipated, and dissipated >= 0."""

import inspect
from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Scalar
from components import blocks, electrical, hydraulic, rotational, thermal, translational

DOMAINS = (blocks, electrical, hydraulic, rotational, thermal, translational)

ANGLES = jnp.linspace(0.0, 2.0 * jnp.pi, 9)
LIFTS = 0.3 * (1.0 - jnp.cos(ANGLES))
MESH = rotational.MeshLoss(efficiency=0.8, transition_power=0.7)
VALVE = dict(area=0.4, density=1.7, discharge_coefficient=0.8, transition_pressure=0.6)


def square(t: Scalar) -> Scalar:
    return jnp.square(t)


# Parameters of order one, so that a random point of order one exercises every term.
EXAMPLES: tuple[Component, ...] = (
    blocks.Clock(),
    blocks.Constant(k=1.3),
    blocks.Gain(k=1.3),
    blocks.Ramp(height=1.3, duration=0.9),
    blocks.Sine(amplitude=1.3, frequency=0.4),
    blocks.Step(height=1.3),
    blocks.Sum(k2=-1.0),
    blocks.TimeFunction(function=square),
    blocks.TimeSeries(times=jnp.array([0.0, 1.0, 3.0]), values=jnp.array([0.0, 2.0, 1.0])),
    electrical.Capacitor(C=1.3),
    electrical.ConstantCurrent(I=1.3),
    electrical.ConstantVoltage(V=1.3),
    electrical.CurrentSensor(),
    electrical.DCMotor(R=1.3, k=0.7, J=0.6, L=0.8, friction=0.4),
    electrical.DCMotor(R=1.3, k=0.7, J=0.6),
    electrical.EMF(k=0.7),
    electrical.Ground(),
    electrical.Inductor(L=1.3),
    electrical.PowerSensor(),
    electrical.Resistor(R=1.3),
    electrical.SignalCurrent(),
    electrical.SignalVoltage(),
    electrical.VoltageSensor(),
    hydraulic.CheckValve(conductance=1.3, cracking_pressure=0.5, transition_pressure=0.6),
    hydraulic.ConstantFlow(flow=1.3),
    hydraulic.ConstantPressure(pressure=1.3),
    hydraulic.FlowSensor(),
    hydraulic.LaminarResistance(resistance=1.3),
    hydraulic.Line(stiffness=1.3, damping=0.6),
    hydraulic.MasterCylinder(bore=1.3),
    hydraulic.OnOffValve(**VALVE),
    hydraulic.Orifice(**VALVE),
    hydraulic.PressureSensor(),
    hydraulic.Pump(displacement=1.3, J=0.7, leakage=0.6, friction=0.4),
    hydraulic.ReliefValve(conductance=1.3, cracking_pressure=0.5, transition_pressure=0.6),
    hydraulic.SignalFlow(),
    hydraulic.SignalPressure(),
    hydraulic.SlaveCylinder(bore=1.3),
    hydraulic.Tank(),
    hydraulic.Volume(volume=1.3, bulk_modulus=0.7),
    rotational.AngleSensor(),
    rotational.Bearing(C=1.3),
    rotational.Cam(profile=rotational.EccentricDisc(eccentricity=0.4, radius=1.3), J=0.7),
    rotational.Cam(profile=rotational.LinearLift(rate=0.4)),
    rotational.Cam(profile=rotational.TabulatedLift(angles=ANGLES, lifts=LIFTS), J=0.7),
    rotational.ConstantTorque(torque=1.3),
    rotational.Damper(d=1.3),
    rotational.Fixed(),
    rotational.IdealGear(ratio=-1.3),
    rotational.Inertia(J=1.3),
    rotational.PlanetaryGear(ratio=1.3),
    rotational.PlanetaryGearbox(ratio=2.3, J_sun=0.7, J_carrier=0.6),
    rotational.PlanetaryGearbox(ratio=2.3, J_sun=0.7, J_carrier=0.6, loss=MESH),
    rotational.SignalSpeed(),
    rotational.SignalTorque(),
    rotational.SpeedSensor(),
    rotational.Spring(c=1.3, phi_rel0=0.4),
    rotational.SpringDamper(c=1.3, d=0.7, phi_rel0=0.4),
    rotational.StribeckFriction(Tc=0.7, Ts=1.3, ws=0.8, w0=0.4),
    rotational.TorqueSensor(),
    rotational.WormGear(ratio=2.3, J=0.7),
    rotational.WormGear(ratio=2.3, J=0.7, loss=MESH),
    thermal.ConstantHeatFlow(heat_flow=1.3),
    thermal.FixedTemperature(temperature=1.3),
    thermal.HeatCapacitor(C=1.3),
    thermal.HeatFlowSensor(),
    thermal.SignalHeatFlow(),
    thermal.TemperatureSensor(),
    thermal.ThermalConductor(G=1.3),
    translational.ClutchSpring(rate=1.3, preload=0.4),
    translational.ConstantForce(force=1.3),
    translational.Damper(d=1.3),
    translational.Fixed(),
    translational.ForceSensor(),
    translational.Mass(m=1.3),
    translational.PositionSensor(),
    translational.SignalForce(),
    translational.SignalPosition(),
    translational.SpeedSensor(),
    translational.Spring(c=1.3, s_rel0=0.4),
    translational.SpringDamper(c=1.3, d=0.7, s_rel0=0.4),
    translational.TabulatedSpring(positions=jnp.array([-0.5, 0.1, 0.8]), forces=jnp.array([0.2, 0.9, 1.1])),
    translational.ViscousFriction(C=1.3),
)


def _name(model: Component) -> str:
    return f"{type(model).__module__.split('.')[1]}.{type(model).__name__}"


def test_every_component_has_an_example() -> None:
    exported = {
        item
        for domain in DOMAINS
        for _, item in inspect.getmembers(domain, inspect.isclass)
        if issubclass(item, Component) and not item._partial
    }
    assert exported == {type(example) for example in EXAMPLES}


@pytest.mark.parametrize("model", EXAMPLES, ids=_name)
def test_energy_balance(model: Component, balances: Callable[[Component], Any]) -> None:
    ports, supplied, stored, dissipated = balances(model)
    np.testing.assert_allclose(ports + supplied, stored + dissipated, rtol=1e-9, atol=1e-9)
    assert np.min(dissipated) >= -1e-15  # rounding
