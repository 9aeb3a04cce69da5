"""Cylinders, lines, valves and the pump against closed forms."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Connections, connect, simulate
from acausal._declare.layout import complete
from components.blocks import Constant
from components.hydraulic import (
    CheckValve,
    ConstantFlow,
    ConstantPressure,
    FlowSensor,
    FluidPort,
    LaminarResistance,
    Line,
    MasterCylinder,
    OnOffValve,
    Orifice,
    PressureSensor,
    Pump,
    ReliefValve,
    SlaveCylinder,
    Tank,
    Volume,
)
from components.rotational import SignalSpeed
from components.translational import ClutchSpring, ConstantForce, Mass, ViscousFriction

BETA = 1.4e9


class Brake(Component):
    """A force on a master cylinder that works on a spring through a line and a slave cylinder."""

    drive: ConstantForce
    pedal: ViscousFriction
    master: MasterCylinder
    line: Line
    slave: SlaveCylinder
    spring: ClutchSpring

    def connections(self) -> Connections:
        return (
            connect(self.drive.flange, self.pedal.flange, self.master.rod),
            connect(self.master.port, self.line.a),
            connect(self.line.b, self.slave.port),
            connect(self.slave.rod, self.spring.flange),
        )


@pytest.mark.thorough
def test_pushing_the_master_in_pushes_the_slave_out() -> None:
    """At rest p = F/A_m; the slave has moved by p A_s/k, and the master by the volume of slave and compression."""
    rig = Brake(
        drive=ConstantForce(force=200.0),
        pedal=ViscousFriction(C=50.0),
        master=MasterCylinder(bore=20e-3),
        line=Line.from_bulk_modulus(bulk_modulus=BETA, volume=2e-5, damping=1e9),
        slave=SlaveCylinder(bore=30e-3),
        spring=ClutchSpring(rate=5e4, preload=10.0),
    )
    end = simulate(rig, 1.0, save="end").final
    area_m, area_s = np.pi / 4 * 20e-3**2, np.pi / 4 * 30e-3**2
    p = 200.0 / area_m
    travel = (p * area_s - 10.0) / 5e4
    assert float(end.line.p) == pytest.approx(p, rel=1e-6)
    assert float(end.slave.rod.s) == pytest.approx(travel, rel=1e-6)
    moved = float(end.slave.rod.s) * area_s + p * 2e-5 / BETA
    assert float(end.master.rod.s) * area_m == pytest.approx(moved, rel=1e-6)


@pytest.mark.parametrize(("cylinder", "sense"), [(MasterCylinder, 1.0), (SlaveCylinder, -1.0)])
def test_cylinder_signs_and_power(cylinder: Any, sense: float) -> None:
    """A pressure presses the master's rod out of what pushes it, and pushes with the slave's; no power is lost."""
    v, p = 0.3, 2e6
    here = complete(cylinder(bore=0.02, port=FluidPort(p=p)))
    area = np.pi / 4 * 0.02**2
    assert float(jnp.asarray(here.area)) == pytest.approx(area)
    equations = here.equations(complete(cylinder(bore=0.02, rod=type(here.rod)(s=v))))
    q, f = (-float(jnp.asarray(equations[name].residual)) for name in ("displacement", "force"))
    assert q == pytest.approx(-sense * area * v)
    assert f == pytest.approx(sense * area * p)
    assert p * q + f * v == pytest.approx(0.0, abs=1e-12)


class Helmholtz(Component):
    """A piston on a closed line."""

    line: Line
    slave: SlaveCylinder
    piston: Mass

    def connections(self) -> Connections:
        return (connect(self.line.b, self.slave.port), connect(self.slave.rod, self.piston.a))


@pytest.mark.thorough
def test_helmholtz_frequency() -> None:
    """omega = A sqrt(beta/(V m)), which is 3741.66 rad/s here; the piston stops after a quarter period."""
    A, V, m = 1e-3, 1e-4, 1.0
    rig = Helmholtz(
        line=Line.from_bulk_modulus(bulk_modulus=BETA, volume=V),
        slave=SlaveCylinder(bore=np.sqrt(4 * A / np.pi)),
        piston=Mass(m=m, v=0.1),
    )
    sol = simulate(rig, 1e-2, until=lambda s: s.piston.v, rtol=1e-10, save="end")
    assert float(sol.t1) == pytest.approx(0.5 * np.pi / 3741.657387, rel=1e-8)


class Filling(Component):
    """A constant flow into a chamber and into a line."""

    flow: ConstantFlow
    chamber: Volume
    line: Line
    line_flow: ConstantFlow
    gauge: PressureSensor = PressureSensor()

    def connections(self) -> Connections:
        return (
            connect(self.flow.port, self.chamber.port, self.gauge.port),
            connect(self.line_flow.port, self.line.a),
        )


def test_constant_inflow() -> None:
    """dp/dt = beta Q/V for the chamber; for the line, p = Kf Q t + Cf Q."""
    rig = Filling(
        flow=ConstantFlow(flow=1e-6),
        chamber=Volume(volume=1e-5, bulk_modulus=BETA),
        line=Line(stiffness=1.494e14, damping=6.8e11),
        line_flow=ConstantFlow(flow=2e-6),
    )
    end = simulate(rig, 0.02, save="end").final
    assert float(end.gauge.y.value) == pytest.approx(1.4e8 * 0.02, rel=1e-9)
    assert float(end.line.p) == pytest.approx(1.494e14 * 2e-6 * 0.02 + 6.8e11 * 2e-6, rel=1e-9)


class Discharge(Component):
    """A chamber under pressure that empties through an orifice, and one through a capillary."""

    chamber: Volume
    orifice: Orifice
    other: Volume
    capillary: LaminarResistance
    tank: Tank = Tank()
    sensor: FlowSensor = FlowSensor()

    def connections(self) -> Connections:
        return (
            connect(self.chamber.port, self.orifice.a),
            connect(self.other.port, self.capillary.a),
            connect(self.orifice.b, self.capillary.b, self.sensor.a),
            connect(self.sensor.b, self.tank.port),
        )


@pytest.mark.thorough
def test_discharge() -> None:
    """Through an orifice sqrt(p) falls linearly in time, through a capillary p falls exponentially."""
    V, p0, density, area, cd = 1e-4, 1e7, 850.0, 1e-7, 0.61
    K = cd * area * np.sqrt(2.0 / density)
    extinction = 2.0 * V * np.sqrt(p0) / (BETA * K)
    capillary = LaminarResistance.from_pipe(diameter=1e-3, length=0.5, viscosity=0.04)
    R = 128.0 * 0.04 * 0.5 / (np.pi * 1e-12)
    assert float(jnp.asarray(capillary.resistance)) == pytest.approx(R)
    rig = Discharge(
        chamber=Volume(volume=V, bulk_modulus=BETA, p=p0),
        orifice=Orifice(area=area, density=density, discharge_coefficient=cd, transition_pressure=10.0),
        other=Volume(volume=V, bulk_modulus=BETA, p=p0),
        capillary=capillary,
    )
    times = np.linspace(0.0, 0.9, 10) * extinction
    sol = simulate(rig, times[-1], save=jnp.asarray(times), rtol=1e-8)
    p = (np.sqrt(p0) - BETA * K * times / (2.0 * V)) ** 2
    laminar = p0 * np.exp(-BETA * times / (R * V))
    np.testing.assert_allclose(sol["chamber.p"], p, rtol=1e-5)
    np.testing.assert_allclose(sol["other.p"], laminar, rtol=1e-5, atol=1.0)
    np.testing.assert_allclose(sol["sensor.y.value"], K * np.sqrt(p) + laminar / R, rtol=1e-5)


class Circuit(Component):
    """A pump on a relief valve and a throttle, from tank to tank; a check valve and a shut valve hold pressures."""

    speed: Constant
    pump: Pump
    relief: ReliefValve
    throttle: LaminarResistance
    opening: Constant
    valve: OnOffValve
    check: CheckValve
    pressure: ConstantPressure
    tank: Tank = Tank()
    drive: SignalSpeed = SignalSpeed()

    def connections(self) -> Connections:
        return (
            connect(self.speed.y, self.drive.u),
            connect(self.opening.y, self.valve.u),
            connect(self.drive.flange, self.pump.shaft),
            connect(self.tank.port, self.pump.a, self.relief.b, self.throttle.b, self.valve.b),
            connect(self.pump.b, self.relief.a, self.throttle.a, self.valve.a, self.check.a),
            connect(self.check.b, self.pressure.port),
        )


def circuit(*, speed: float, opening: float) -> Circuit:
    return Circuit(
        speed=Constant(k=speed),
        pump=Pump(displacement=2e-7, leakage=1e-13, friction=1e-3),
        relief=ReliefValve(conductance=1e-10, cracking_pressure=5e6),
        throttle=LaminarResistance(resistance=1e12),
        opening=Constant(k=opening),
        valve=OnOffValve(area=1e-6, density=850.0),
        check=CheckValve(conductance=1e-10),
        pressure=ConstantPressure(pressure=2e7),
    )


@pytest.mark.thorough
def test_pump_relief_and_check_valve() -> None:
    """D w = leakage p + p/R + G (p - p_c + 1e-6 p); the shaft takes D p + friction w; nothing passes shut or checked
    valves.
    """
    end = simulate(circuit(speed=200.0, opening=0.0), 0.1, save="end").final
    p = (2e-7 * 200.0 + 1e-10 * 5e6) / (1e-13 + 1e-12 + 1e-10 * (1.0 + 1e-6))
    assert float(end.pump.dp) == pytest.approx(p, rel=1e-9)
    assert float(end.pump.shaft.tau) == pytest.approx(2e-7 * p + 1e-3 * 200.0, rel=1e-9)
    assert float(end.pump.q) == pytest.approx(2e-7 * 200.0 - 1e-13 * p, rel=1e-9)
    assert float(end.valve.q) == 0.0
    assert abs(float(end.check.q)) < 1e-10 * 1e3 * np.exp(-2e4 / 1e3) * 1.001


@pytest.mark.thorough
def test_open_valve_is_an_orifice() -> None:
    """The relief valve only leaks, and D w = (leakages + 1/R) p + C_d A sqrt(2 p/rho)."""
    end = simulate(circuit(speed=200.0, opening=1.0), 0.1, save="end").final
    K, resistance = 0.61e-6 * np.sqrt(2.0 / 850.0), 1e-13 + 1e-12 + 1e-10 * 1e-6
    root = (-K + np.sqrt(K**2 + 4.0 * resistance * 2e-7 * 200.0)) / (2.0 * resistance)
    assert float(end.pump.dp) == pytest.approx(root**2, rel=1e-6)


def test_rounded_valve_is_the_ideal_one_but_for_its_corner() -> None:
    """The flow at the corner is ln 2 times transition pressure times conductance; backward it stays below S(0)."""

    def flow(dp: float) -> float:
        valve = complete(
            ReliefValve(conductance=1e-10, cracking_pressure=5e6, transition_pressure=1e4, leakage=0.0, dp=dp)
        )
        return -float(jnp.asarray(valve.equations(valve)["law"].residual))

    assert flow(0.0) == 0.0
    assert flow(5e6) == pytest.approx(1e-10 * 1e4 * np.log(2.0))
    assert flow(6e6) == pytest.approx(1e-10 * 1e6)
    assert -1e-100 < flow(-1e7) <= 0.0
