"""Wet dual-clutch actuation of a car: a motor drives a pump with an unloading valve, an accumulator supplies two
clutches behind proportional pressure-reducing valves. 17 states; the second clutch transmits 333.5 N.m at the end.
"""

from typing import Any

import jax.numpy as jnp
import numpy as np

from acausal import Component, Connections, connect, quantity, simulate
from components.blocks import FirstOrder, Gain, Input, Limiter, SampleHold, Sum, TimeSeries
from components.electrical import ConstantVoltage, DCMotor, Ground
from components.hydraulic import (
    AnnularGap,
    Chamber,
    CheckValve,
    DrilledPassage,
    FixedPump,
    FluidPort,
    GasAccumulator,
    PressureSensor,
    SingleActingCylinder,
    Tank,
    ThreeWayValve,
    UnloadingValve,
    WilsonLosses,
    iso_vg_32,
)
from components.translational import Damper, ElastoGap, Fixed, Flange, HardStop, Mass, Spring

END = 0.3  # s
BORE, PRELOAD, STIFFNESS, PACK = 0.07, 6e-3, 1.2e5, 2e7  # m, m, N/m, N/m


class ClutchValve(Component):
    """Proportional pressure-reducing valve, with hydromechanical feedback of the outlet pressure."""

    error: Sum
    gain: Gain
    limiter: Limiter
    spool: FirstOrder
    valve: ThreeWayValve
    sensor: PressureSensor
    u: Input = Input()
    p: FluidPort = FluidPort()
    t: FluidPort = FluidPort()
    a: FluidPort = FluidPort()

    def connections(self) -> Connections:
        return (
            connect(self.u, self.error.u1),
            connect(self.sensor.y, self.error.u2),
            connect(self.error.y, self.gain.u),
            connect(self.gain.y, self.limiter.u),
            connect(self.limiter.y, self.spool.u),
            connect(self.spool.y, self.valve.u),
            connect(self.p, self.valve.p),
            connect(self.t, self.valve.t),
            connect(self.a, self.valve.a, self.sensor.port),
        )


class ClutchLine(Component):
    """Valve, line, piston, return spring, pack and leakage of a clutch."""

    command: TimeSeries
    hold: SampleHold
    valve: ClutchValve
    gallery: Chamber
    line: DrilledPassage
    cylinder: SingleActingCylinder
    leak: AnnularGap
    piston: Mass
    spring: Spring
    pack: ElastoGap
    stop: HardStop
    drag: Damper
    sump: Tank = Tank()
    wall: Fixed = Fixed()
    p: FluidPort = FluidPort()
    t: FluidPort = FluidPort()

    def connections(self) -> Connections:
        return (
            connect(self.command.y, self.hold.u),
            connect(self.hold.y, self.valve.u),
            connect(self.p, self.valve.p),
            connect(self.t, self.valve.t),
            connect(self.valve.a, self.gallery.port, self.line.a),
            connect(self.line.b, self.cylinder.port, self.leak.a),
            connect(self.leak.b, self.sump.port),
            connect(self.cylinder.flange, self.piston.a, self.stop.flange, self.spring.b, self.pack.a, self.drag.b),
            connect(self.wall.flange, self.spring.a, self.pack.b, self.drag.a),
        )


class DualClutch(Component):
    """The supply and both clutches."""

    battery: ConstantVoltage
    motor: DCMotor
    pump: FixedPump
    check: CheckValve
    charge: UnloadingValve
    accumulator: GasAccumulator
    rail: Chamber
    outlet: Chamber
    c1: ClutchLine
    c2: ClutchLine
    ground: Ground = Ground()
    tank: Tank = Tank()

    def connections(self) -> Connections:
        return (
            connect(self.battery.p, self.motor.p),
            connect(self.battery.n, self.motor.n, self.ground.p),
            connect(self.motor.shaft, self.pump.shaft),
            connect(self.tank.port, self.pump.a, self.charge.b, self.c1.t, self.c2.t),
            connect(self.pump.b, self.outlet.port, self.check.a, self.charge.a),
            connect(self.check.b, self.accumulator.port, self.charge.pilot, self.rail.port, self.c1.p, self.c2.p),
        )


def _line(oil: Any, times: list[float], pressures: list[float], s: float, p: float) -> ClutchLine:
    return ClutchLine(
        command=TimeSeries(times=times, values=pressures, smooth=False),
        hold=SampleHold(period=1e-3),
        valve=ClutchValve(
            error=Sum(k2=-1.0),
            gain=Gain(k=1e-5),
            limiter=Limiter(u_max=1.0, u_min=-1.0),
            spool=FirstOrder(T=3e-3),
            valve=ThreeWayValve(rated_flow=quantity(12.0, "l/min"), rated_drop=5e5, leakage=1e-3),
            sensor=PressureSensor(),
        ),
        gallery=Chamber(volume=2e-5, liquid=oil, wall=2e-9, p=p),
        line=DrilledPassage(diameter=5e-3, length=0.4, corners=3, liquid=oil),
        cylinder=SingleActingCylinder(bore=BORE, liquid=oil, dead=1.5e-5, p=p),
        leak=AnnularGap(diameter=BORE, clearance=2.5e-5, length=8e-3, liquid=oil),
        piston=Mass(m=0.4, v=0.0, a=Flange(s=s)),
        spring=Spring(c=STIFFNESS, s_rel0=-4e-3),
        pack=ElastoGap(c=PACK, d=2e3, s_rel0=-2e-3),
        stop=HardStop(s_min=0.0, s_max=4e-3),
        drag=Damper(d=400.0),
    )


def dual_clutch() -> DualClutch:
    """The machine with the first clutch closed at 12 bar, which hands over to the second."""
    oil = iso_vg_32(temperature=313.15)
    area, closed = np.pi / 4 * BORE**2, 12e5
    opening = [0.0, 0.03, 0.08, END], [closed, closed, 0.0, 0.0]
    closing = [0.0, 0.001, 0.04, 0.041, 0.07, 0.13, END], [0.0, 12e5, 12e5, 2.5e5, 3e5, 14e5, 14e5]
    return DualClutch(
        battery=ConstantVoltage(V=12.0),
        motor=DCMotor(R=0.05, L=1e-4, k=0.035, J=2e-4),
        pump=FixedPump(
            displacement=quantity(2.0, "cm3/rev"),
            liquid=oil,
            losses=WilsonLosses(C_s=5e-9, C_v=2e5, C_f=0.03, T_c=0.05),
            J=2e-5,
        ),
        check=CheckValve(conductance=2e-9),
        charge=UnloadingValve(rated_flow=3e-4, rated_drop=2e5, band=2e5, pressure=30e5),
        accumulator=GasAccumulator(capacity=1.5e-4, resistance=2e8, volume=2e-4, precharge=12e5, p=20e5),
        rail=Chamber(volume=5e-5, liquid=oil, wall=1e-9, p=20e5),
        outlet=Chamber(volume=2e-5, liquid=oil, p=20e5),
        c1=_line(oil, *opening, 2.0e-3 + (closed * area - STIFFNESS * PRELOAD) / PACK, closed),
        c2=_line(oil, *closing, 0.0, 0.0),
    )


def torque(model: DualClutch) -> Any:
    """Friction torque of the second pack at the end: coefficient 0.12, 8 surfaces, radius 75 mm."""
    pack = simulate(model, END, save="end").final.c2.pack
    return 0.12 * 8 * 0.075 * jnp.maximum(-pack.f, 0.0)
