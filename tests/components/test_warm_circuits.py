"""Circuits whose liquid carries heat."""

from typing import Any

import jax
import numpy as np
import pytest
import scipy.linalg
from _rig import Rig

from acausal import ArgumentError, Component, Connections, check, connect, simulate
from components.blocks import Sine
from components.hydraulic import (
    BootstrapTank,
    Chamber,
    ConstantFlow,
    DoubleActingCylinder,
    FixedPump,
    FourWayValve,
    HeatCarrier,
    LaminarResistance,
    NoFriction,
    Pipe,
    PipeWall,
    ReliefValve,
    Tank,
    WilsonLosses,
    fill,
    iso_vg_46,
)
from components.rotational import ConstantSpeed
from components.thermal import FixedTemperature, HeatCapacitor, HeatPort, ThermalConductor
from components.translational import Fixed, Mass, SpringDamper

OIL = iso_vg_46(temperature=293.15, carries_heat=True)
COLD = iso_vg_46(temperature=293.15)
CAPACITY = float(OIL.reference_density * OIL.caloric.specific_heat)  # type: ignore[union-attr]


def test_convection_and_conduction_between_node_and_part() -> None:
    """Upwind with the flow, conduction at rest, and the exact solution in between."""
    carrier = HeatCarrier(capacity=2e6, temperature=300.0, conductance=0.1)
    peclet = np.array([-1e6, -3.0, -1e-9, 0.0, 1e-9, 3.0, 1e6])
    found = jax.vmap(lambda q: carrier.flow(q, 320.0, 310.0))(peclet * 0.1 / 2e6)
    x = peclet[[1, 5]]
    exact = 0.1 * (x * (20.0 * np.exp(x) - 10.0) / np.expm1(x))
    np.testing.assert_allclose(found, [-1e6, exact[0], 1.0, 1.0, 1.0, exact[1], 2e6], rtol=1e-7)
    slope = jax.grad(lambda q: carrier.flow(q, 320.0, 310.0))
    np.testing.assert_allclose(slope(0.0), slope(1e-14), rtol=1e-6)


def throttled(flow: Any, throttle: Any, tank: Any) -> Connections:
    return (connect(flow.port, throttle.a), connect(throttle.b, tank.port))


def test_throttling_heats_by_the_pressure_drop_over_the_heat_capacity() -> None:
    q, drop = 1e-4, 100e5
    parts = (ConstantFlow(flow=q), LaminarResistance(resistance=drop / q), Tank())
    rig = fill(Rig(parts=parts, wiring=throttled), OIL)
    solution = simulate(rig, 1.0, save="end", energy=True)
    _, throttle, tank = solution.final.parts
    np.testing.assert_allclose(throttle.heat.T - 293.15, drop / CAPACITY, rtol=1e-9)
    assert tank.port.H_flow == pytest.approx(q * drop, rel=1e-9)
    assert abs(solution.energy.imbalance) < 1e-6 * q * drop


def test_a_pipe_carries_temperature_from_node_to_node() -> None:
    """A pipe of two segments under a flow of hot oil: three volumes in series, and no loss of heat."""
    q, hot, length, area = 1e-5, 313.15, 2.0, 0.25 * np.pi * 0.01**2
    parts = (
        ConstantFlow(flow=q, heat=HeatPort()),
        Pipe(n=2, length=length, diameter=0.01, liquid=COLD, friction=NoFriction(), q=q),
        Tank(),
        FixedTemperature(temperature=hot),
    )
    rig = fill(Rig(parts=parts, wiring=piped), OIL)
    times = np.array([5.0, 10.0, 20.0, 60.0])
    solution = simulate(rig, 60.0, save=times, energy=True)
    mean, half = length * area / q, 0.25
    rates = np.array([1.0 / (share * mean) for share in (half, 0.5, half)])
    chain = np.array([[-rates[0], 0, 0], [rates[1], -rates[1], 0], [0, rates[2], -rates[2]]])
    expected = [hot - 20.0 * scipy.linalg.expm(chain * t) @ np.ones(3) for t in times]
    np.testing.assert_allclose(solution["parts[1].heat.T"], expected, atol=0.05)
    assert abs(solution.energy.imbalance) < 1e-6 * CAPACITY * q * 20.0 * 60.0


def piped(source: Any, pipe: Any, tank: Any, bath: Any) -> Connections:
    return (connect(source.port, pipe.a), connect(pipe.b, tank.port), connect(source.heat, bath.port))


class Press(Component):
    """A pump drives a cylinder out and in through a valve; the relief valve takes the surplus."""

    motor: ConstantSpeed
    pump: FixedPump
    relief: ReliefValve
    line: Chamber
    valve: FourWayValve
    command: Sine
    cylinder: DoubleActingCylinder
    mass: Mass
    spring: SpringDamper
    support: Fixed
    tank: Tank
    oil: HeatCapacitor
    wall: ThermalConductor
    room: FixedTemperature

    def connections(self) -> Connections:
        pump, relief, valve, cylinder = self.pump, self.relief, self.valve, self.cylinder
        tank: Any = self.tank
        return (
            connect(self.motor.flange, pump.shaft),
            connect(pump.b, self.line.port, relief.a, valve.p),
            connect(pump.a, relief.b, valve.t, tank.port),
            connect(tank.heat, self.oil.port, self.wall.a),
            connect(self.wall.b, self.room.port),
            connect(self.command.y, valve.u),
            connect(valve.a, cylinder.a),
            connect(valve.b, cylinder.b),
            connect(cylinder.flange, self.mass.a),
            connect(self.mass.b, self.spring.a),
            connect(self.spring.b, self.support.flange),
        )


def press() -> Press:
    losses = WilsonLosses(C_s=2e-9, C_v=1e5, C_f=0.02)
    return Press(
        motor=ConstantSpeed(speed=150.0),
        pump=FixedPump(displacement=1.5e-6, liquid=COLD, losses=losses),
        relief=ReliefValve(cracking_pressure=100e5, conductance=1e-9),
        line=Chamber(volume=1e-3, liquid=COLD),
        valve=FourWayValve(rated_flow=3e-4, rated_drop=5e5, leakage=1e-3),
        command=Sine(amplitude=1.0, frequency=0.5),
        cylinder=DoubleActingCylinder(
            bore=0.05, rod=0.03, stroke=0.5, liquid=COLD, dead_a=1e-4, dead_b=1e-4, leakage=1e-13
        ),
        mass=Mass(m=100.0, s=0.25),
        spring=SpringDamper(c=1e4, d=1e3, s_rel0=-0.25),
        support=Fixed(),
        tank=Tank(heat=HeatPort()),
        oil=HeatCapacitor(C=2e4),
        wall=ThermalConductor(G=20.0),
        room=FixedTemperature(temperature=293.15),
    )


@pytest.fixture(scope="module")
def warm() -> Press:
    return fill(press(), OIL)


@pytest.mark.thorough
def test_the_account_of_a_working_press_closes(warm: Press) -> None:
    """Everything the motor supplies is stored as heat or leaves through the wall: no part dissipates."""
    solution = simulate(warm, 6.0, energy=True, save="end")
    energy = solution.energy
    assert abs(energy.imbalance) < 1e-6 * energy.supplied["motor"]
    dissipated = {path for path, value in energy.dissipated.items() if abs(value) > 0.0}
    assert dissipated == {"spring"}
    final: Any = solution.final
    assert final.oil.T > 293.2
    assert final.relief.heat.T > final.oil.T


def cooled(source: Any, pipe: Any, wall: Any, room: Any, tank: Any) -> Connections:
    return (
        connect(source.port, pipe.a),
        connect(pipe.b, tank.port),
        connect(pipe.heat, wall.inside),
        connect(wall.outside, room.port),
    )


def test_a_long_pipe_cools_its_liquid_exponentially() -> None:
    """T = T_room + (T_in - T_room) exp(-U A/C), with a first-order error of U A/C/(2 n); friction is negligible."""
    q, n = 2e-5, 40
    pipe = Pipe(n=n, length=20.0, diameter=0.02, liquid=COLD, friction=NoFriction(), q=q, heat=True)
    wall = PipeWall.around(pipe, U=20.0)
    parts = (ConstantFlow(flow=q), pipe, wall, FixedTemperature(temperature=273.15), Tank())
    rig = fill(Rig(parts=parts, wiring=cooled), OIL)
    end = simulate(rig, 3600.0, save="end").final.parts[1].heat.T[-1]
    units = 20.0 * np.pi * 0.02 * 20.0 / (CAPACITY * q)
    np.testing.assert_allclose(end, 273.15 + 20.0 * np.exp(-units), atol=20.0 * units**2 / n)


def test_parts_that_cannot_carry_heat_are_named() -> None:
    with pytest.raises(ArgumentError, match=r"^BootstrapTank cannot carry heat, .* Chamber, a Pipe or a Single"):
        fill(BootstrapTank(area=0.01, pilot_area=2e-4, stroke=0.1), OIL)
    with pytest.raises(
        ArgumentError, match=r"^FourWayValve: liquids that carry heat take the losses along. Omit `heat`"
    ):
        fill(FourWayValve(rated_flow=1e-4, rated_drop=1e5, heat=HeatPort()), OIL)
    with pytest.raises(ArgumentError, match="Chamber carries heat already"):
        fill(fill(Chamber(volume=1e-3, liquid=COLD), OIL), OIL)


def test_a_liquid_that_carries_heat_needs_fill() -> None:
    problem = "The liquid of {} carries heat, but its ports do not. Use fill(model, liquid)"
    assert problem.format("Chamber") in str(check(Chamber(volume=1e-3, liquid=OIL)))
    assert problem.format("Chamber") in str(check(Chamber(volume=1e-3, liquid=OIL, heat=HeatPort())))
    assert problem.format("Pipe") in str(check(Pipe(n=2, length=1.0, diameter=0.01, liquid=OIL, heat=True)))
