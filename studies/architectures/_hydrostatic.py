"""Electrohydrostatic actuators: the pump moves the slave directly, without a valve."""

from typing import Any

from acausal import Component, Connections, connect
from components.blocks import Limiter, LimPI, SecondOrder, Sum
from components.electrical import ConstantVoltage, DCMotor, Ground, SignalVoltage
from components.hydraulic import (
    CheckValve,
    DoubleActingCylinder,
    FixedPump,
    GasAccumulator,
    PilotStage,
    ReliefValve,
    ServoPump,
    Tank,
    VariableOrifice,
    VariablePump,
)
from components.translational import ClutchSpring, Mass, PositionSensor, ViscousFriction

from ..actuators import SUPPLY, ehs_maxon
from ._duty import Demand
from ._parts import Controlled, drain, liquid, load, motor_control, pump_data, re40, relief, spool, valve_control

BIAS = 2e5  # Pa, pressure of both sides at rest
ROD = 8e-3  # m, rod diameter on both sides of the piston
CHAMBER = 1e-5  # m3, dead volume of each side; as stiff as the line of the other actuators


class ClosedCircuit(Component, partial=True):
    """Pump and synchronous cylinder. An accumulator replaces the flow of the relief valves through check valves."""

    supply: ConstantVoltage | SignalVoltage
    motor: DCMotor
    pump: FixedPump | ServoPump
    slave: DoubleActingCylinder
    piston: Mass
    seal: ViscousFriction
    clutch: ClutchSpring
    accumulator: GasAccumulator
    check_a: CheckValve
    check_b: CheckValve
    relief_a: ReliefValve
    relief_b: ReliefValve
    demand: Demand
    gauge: PositionSensor
    controller: LimPI
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.supply.p, self.motor.p),
            connect(self.supply.n, self.motor.n, self.ground.p),
            connect(self.motor.shaft, self.pump.shaft),
            connect(self.pump.b, self.slave.a, self.check_a.b, self.relief_a.a),
            connect(self.pump.a, self.slave.b, self.check_b.b, self.relief_b.a),
            connect(self.accumulator.port, self.check_a.a, self.check_b.a, self.relief_a.b, self.relief_b.b),
            connect(self.slave.flange, self.piston.a, self.seal.flange, self.clutch.flange, self.gauge.flange),
            connect(self.demand.y, self.controller.u_s),
            connect(self.gauge.y, self.controller.u_m),
        )


class ServoMotorActuator(ClosedCircuit):
    """A reversible servo motor with a fixed pump."""

    supply: SignalVoltage  # pyright: ignore[reportIncompatibleVariableOverride]
    pump: FixedPump  # pyright: ignore[reportIncompatibleVariableOverride]

    def connections(self) -> Connections:
        return *super().connections(), connect(self.controller.y, self.supply.u)


class ServoPumpActuator(ClosedCircuit):
    """A motor that turns continuously, with a pump whose displacement is reversible."""

    supply: ConstantVoltage  # pyright: ignore[reportIncompatibleVariableOverride]
    pump: ServoPump  # pyright: ignore[reportIncompatibleVariableOverride]

    def connections(self) -> Connections:
        return *super().connections(), connect(self.controller.y, self.pump.u)


class VariablePurgeActuator(Controlled):
    """A motor that turns continuously, a variable pump with a tank, and a purge valve between pump and slave.

    One controller acts on both: it sets the displacement to open and hold, and opens the purge valve to close.
    """

    supply: ConstantVoltage  # pyright: ignore[reportIncompatibleVariableOverride]
    forward: Limiter
    back: Sum
    pump: ServoPump
    spool: SecondOrder
    purge: VariableOrifice
    tank: Tank = Tank()

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.motor.shaft, self.pump.shaft),
            connect(self.tank.port, self.pump.a, self.purge.b),
            connect(self.pump.b, self.line.a, self.purge.a),
            connect(self.controller.y, self.forward.u, self.back.u2),
            connect(self.forward.y, self.pump.u, self.back.u1),
            connect(self.back.y, self.spool.u),
            connect(self.spool.y, self.purge.u),
        )


def across_the_pump(s: Any) -> Any:
    """Pressure rise and flow of the pump."""
    pump = s.pump.pump if hasattr(s.pump, "pump") else s.pump
    return pump.dp, -pump.b.q


def across_the_piston(s: Any) -> Any:
    """Pressure difference across the piston, and flow into the cylinder."""
    return s.slave.p_a - s.slave.p_b, s.slave.a.q


def servo_motor() -> ServoMotorActuator:
    """EHA with servo motor. The equations of a brushed motor represent the brushless machine with its electronics."""
    return ServoMotorActuator(
        supply=SignalVoltage(), pump=FixedPump(**pump_data()), controller=motor_control(), **_closed()
    )


def servo_pump() -> ServoPumpActuator:
    """EHA with servo pump. The supply is a battery, so a DC motor instead of an induction motor turns the pump."""
    return ServoPumpActuator(
        supply=ConstantVoltage(V=SUPPLY), pump=_variable(), controller=valve_control(), **_closed()
    )


def variable_purge() -> VariablePurgeActuator:
    """The on-demand pump with purge valve of Honda's patent; the thesis gives no details."""
    return VariablePurgeActuator(
        supply=ConstantVoltage(V=SUPPLY), motor=re40(), forward=Limiter(u_min=0.0, u_max=1.0), back=Sum(k2=-1.0),
        pump=_variable(), spool=spool(), purge=drain(), controller=valve_control(), **load(),
    )  # fmt: skip


def _variable() -> ServoPump:
    return ServoPump(swash=PilotStage(w=150.0, D=0.8, rate=25.0), pump=VariablePump(**pump_data()))


def _closed() -> dict[str, Any]:
    parts = load()
    del parts["line"]
    bore = (float(ehs_maxon().slave.bore) ** 2 + ROD**2) ** 0.5
    parts["slave"] = DoubleActingCylinder(
        bore=bore, rod=ROD, rod_a=ROD, stroke=20e-3, dead_a=CHAMBER, dead_b=CHAMBER, liquid=liquid(), p_a=BIAS, p_b=BIAS
    )
    volume, precharge, exponent = 2e-5, 1.5e5, 1.4
    filled = volume * (1.0 - ((precharge + 101325.0) / (BIAS + 101325.0)) ** (1.0 / exponent))
    accumulator = GasAccumulator(
        capacity=0.8 * volume, resistance=1e9, volume=volume, precharge=precharge, n=exponent, V=filled
    )
    check = CheckValve(conductance=1e-9, cracking_pressure=2e4)
    return dict(
        motor=re40(), accumulator=accumulator, check_a=check, check_b=check, relief_a=relief(), relief_b=relief(),
        **parts,
    )  # fmt: skip
