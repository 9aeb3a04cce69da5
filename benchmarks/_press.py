"""An electro-hydraulic press axis with sampled control: what reading its runs costs, beside running it.

A permanent-magnet machine on an inverter turns a fixed pump that feeds the bore side of a cylinder; an accumulator
loads the rod side. The currents are controlled at 10 kHz, the speed at 2 kHz, the position at 1 kHz.
"""

import jax.numpy as jnp

from acausal import Component, Connections, connect, quantity
from components.blocks import Constant, Gain, Limiter, SampledPI, SampleHold, Sum, TimeSeries
from components.electrical import PMSM, ConstantVoltage, DqCurrentSensor, DqMachine, Ground, Inverter
from components.hydraulic import (
    CheckValve,
    DoubleActingCylinder,
    FixedPump,
    GasAccumulator,
    HydraulicCylinder,
    Pipe,
    ReliefValve,
    Tank,
    WilsonLosses,
    iso_vg_46,
)
from components.rotational import SpeedSensor
from components.translational import ConstantForce, ElastoGap, Fixed, Flange, Mass, PositionSensor


class Drive(Component):
    """Inverter, machine and sampled d/q current control."""

    dc: ConstantVoltage
    inverter: Inverter
    sensor: DqCurrentSensor
    motor: PMSM
    pi_d: SampledPI
    pi_q: SampledPI
    i_d: Constant
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.dc.p, self.inverter.p),
            connect(self.dc.n, self.inverter.n, self.ground.p),
            connect(self.inverter.machine, self.sensor.p),
            connect(self.sensor.n, self.motor.terminals),
            connect(self.i_d.y, self.pi_d.u_s),
            connect(self.sensor.y_d, self.pi_d.u_m),
            connect(self.sensor.y_q, self.pi_q.u_m),
            connect(self.pi_d.y, self.inverter.u_d),
            connect(self.pi_q.y, self.inverter.u_q),
        )


class Press(Component):
    """The axis, from the reference of its position to the table that it presses on."""

    drive: Drive
    tacho: SpeedSensor
    speed: SampledPI
    reference: TimeSeries
    error: Sum
    sample: SampleHold
    position: Gain
    limit: Limiter
    sensor: PositionSensor
    pump: FixedPump
    suction: CheckValve
    relief: ReliefValve
    hose: Pipe
    cylinder: HydraulicCylinder
    accumulator: GasAccumulator
    relief_b: ReliefValve
    load: Mass
    weight: ConstantForce
    work: ElastoGap
    table: Fixed
    tank: Tank = Tank()

    def connections(self) -> Connections:
        return (
            connect(self.drive.motor.shaft, self.pump.shaft, self.tacho.flange),
            connect(self.reference.y, self.error.u1),
            connect(self.sensor.y, self.error.u2),
            connect(self.error.y, self.sample.u),
            connect(self.sample.y, self.position.u),
            connect(self.position.y, self.limit.u),
            connect(self.limit.y, self.speed.u_s),
            connect(self.tacho.y, self.speed.u_m),
            connect(self.speed.y, self.drive.pi_q.u_s),
            connect(self.tank.port, self.pump.a, self.suction.a, self.relief.b, self.relief_b.b),
            connect(self.pump.b, self.suction.b, self.relief.a, self.hose.a),
            connect(self.hose.b, self.cylinder.a),
            connect(self.cylinder.b, self.accumulator.port, self.relief_b.a),
            connect(self.cylinder.flange, self.load.a),
            connect(self.load.b, self.weight.flange, self.work.a, self.sensor.flange),
            connect(self.work.b, self.table.flange),
        )


def press() -> Press:
    """The axis in its rest position, which travels 150 mm, presses, and returns within 2.4 s."""
    oil = iso_vg_46(temperature=318.15)
    bore, rod, s0, mass, p_b = 0.063, 0.045, 0.05, 300.0, 80e5
    weight = mass * 9.81
    area, ring = jnp.pi / 4 * bore**2, jnp.pi / 4 * (bore**2 - rod**2)
    p_a = (p_b * ring - weight) / area
    return Press(
        drive=Drive(
            dc=ConstantVoltage(V=560.0),
            inverter=Inverter(),
            sensor=DqCurrentSensor(),
            motor=PMSM(machine=DqMachine(p=4, psi=0.2, Ld=3e-3, Lq=3e-3, Rs=0.3), J=4e-3),
            pi_d=SampledPI(period=1e-4, k=6.0 / 560, T=5e-3, y_min=-0.57, y_max=0.57),
            pi_q=SampledPI(period=1e-4, k=6.0 / 560, T=5e-3, y_min=-0.57, y_max=0.57),
            i_d=Constant(k=0.0),
        ),
        tacho=SpeedSensor(),
        speed=SampledPI(period=5e-4, k=1.2, T=0.04, y_min=-45.0, y_max=45.0),
        reference=TimeSeries(
            times=[0.0, 0.1, 0.8, 1.2, 1.5, 2.1, 2.4], values=[s0, s0, 0.185, 0.2, 0.2, s0, s0], smooth=False
        ),
        error=Sum(k1=1.0, k2=-1.0),
        sample=SampleHold(period=1e-3),
        position=Gain(k=8e3),
        limit=Limiter(u_min=-320.0, u_max=320.0),
        sensor=PositionSensor(),
        pump=FixedPump(
            displacement=quantity(16.0, "cm3/rev"),
            liquid=oil,
            losses=WilsonLosses(C_s=3e-9, C_v=1e5, C_f=0.03, T_c=0.3),
            J=1e-3,
        ),
        suction=CheckValve(conductance=quantity(20.0, "l/(min.bar)")),
        relief=ReliefValve(cracking_pressure=quantity(210.0, "bar"), conductance=quantity(10.0, "l/(min.bar)")),
        hose=Pipe(n=5, length=6.0, diameter=0.02, wall=5e-10, liquid=oil, p=p_a),
        cylinder=HydraulicCylinder(
            chambers=DoubleActingCylinder(
                bore=bore,
                rod=rod,
                stroke=0.3,
                liquid=oil,
                dead_a=1e-4,
                dead_b=1e-4,
                p_a=p_a,
                p_b=p_b,
                leakage=quantity(0.005, "l/(min.bar)"),
            ),
            m=15.0,
            Fc=400.0,
            Fs=700.0,
            vs=0.01,
            C=2000.0,
        ),
        accumulator=GasAccumulator(capacity=8e-3, resistance=1e8, volume=1e-2, precharge=60e5, p=p_b),
        relief_b=ReliefValve(cracking_pressure=quantity(120.0, "bar"), conductance=quantity(10.0, "l/(min.bar)")),
        load=Mass(m=mass, v=0.0, a=Flange(s=s0)),
        weight=ConstantForce(force=weight),
        work=ElastoGap(c=1e8, d=5e4),
        table=Fixed(s0=0.19),
    )
