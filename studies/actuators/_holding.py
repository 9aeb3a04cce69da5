"""Electrohydraulic actuators that hold the clutch open, by their motor or by a valve.

Actuator and valve are those of Meloni's thesis (Politecnico di Torino, 2012), the valve an Atlantic CEBP with coil M7.
It does not tell how much the seals leak, what liquid is between pump and valve, nor how fast the valve closes: these
values are assumed.
"""

import math

from acausal import Connections, Scalar, connect
from components.blocks import Constant, FirstOrder, Gain, LimPI, TwoPointController
from components.electrical import ConstantVoltage, IdealOpeningSwitch, Resistor, SignalVoltage
from components.hydraulic import LaminarResistance, Line, OnOffValve
from components.translational import PositionSensor

from ._designs import ehs_maxon
from ._models import PumpActuator, pump_parts
from ._opening import STROKE
from ._parameters import SUPPLY

LEAKAGE = 1.5e14  # Pa.s/m3, past the seals: 0.02 cm3/s at the pressure of the open clutch; assumed
CLOSING_TIME = 1e-3  # s, time constant of the valve's seat; assumed
CHAMBER = 1e-6  # m3, between pump and valve; assumed
COIL = 12.0 / 1.62  # ohm, of the thesis' holding valve (Atlantic CEBP with coil M7: 19.4 W)


class HoldingActuator(PumpActuator, partial=True):
    """The electrohydraulic actuator with a leak from the slave cylinder, and a controller of its position."""

    supply: SignalVoltage  # pyright: ignore[reportIncompatibleVariableOverride]
    demand: Constant
    gauge: PositionSensor
    leak: LaminarResistance

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.line.b, self.leak.a),
            connect(self.leak.b, self.tank.port),
            connect(self.gauge.flange, self.slave.rod),
        )


class MotorHeldActuator(HoldingActuator):
    """The motor holds: a PI controller sets its voltage within what the battery gives.

    The converter between battery and motor is taken as lossless: the battery gives what the motor takes.
    """

    controller: LimPI

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.pump.b, self.line.a),
            connect(self.demand.y, self.controller.u_s),
            connect(self.gauge.y, self.controller.u_m),
            connect(self.controller.y, self.supply.u),
        )


class ValveHeldActuator(HoldingActuator):
    """A normally open valve holds: while it is shut by its coil, the motor is off.

    A two-point controller opens it and runs the motor at full voltage whenever the slave has sunk too far. Off means
    that the motor is short-circuited, which brakes it. The valve follows its coil with a lag: one that closed at once
    would stop the turning pump against the little liquid before it, and both would ring. Not modelled: cavitation in
    the chamber, for about a millisecond, while the pump is still being driven back as the valve shuts.
    """

    controller: TwoPointController
    drive: Gain
    travel: FirstOrder
    chamber: Line
    valve: OnOffValve
    battery: ConstantVoltage
    relay: IdealOpeningSwitch
    coil: Resistor

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.demand.y, self.controller.u_s),
            connect(self.gauge.y, self.controller.u_m),
            connect(self.controller.y, self.drive.u, self.travel.u, self.relay.u),
            connect(self.travel.y, self.valve.u),
            connect(self.drive.y, self.supply.u),
            connect(self.pump.b, self.chamber.a),
            connect(self.chamber.b, self.valve.a),
            connect(self.valve.b, self.line.a),
            connect(self.battery.p, self.relay.p),
            connect(self.relay.n, self.coil.p),
            connect(self.coil.n, self.battery.n, self.ground.p),
        )


def motor_held(
    *,
    voltage: Scalar = SUPPLY,
    position: Scalar = STROKE,
    leakage_resistance: Scalar = LEAKAGE,
    gain: Scalar = 5e3,
    integral_time: Scalar = 0.1,
    **others: Scalar,
) -> MotorHeldActuator:
    """The actuator that holds by its motor; `gain` in V/m. `others` go to `ehs_maxon`."""
    base = ehs_maxon(**others)
    return MotorHeldActuator(
        supply=SignalVoltage(),
        demand=Constant(k=position),
        gauge=PositionSensor(),
        leak=LaminarResistance(resistance=leakage_resistance),
        controller=LimPI(k=gain, Ti=integral_time, y_min=0.0, y_max=voltage),
        **pump_parts(base),
    )


def valve_held(
    *,
    voltage: Scalar = SUPPLY,
    position: Scalar = STROKE,
    band: Scalar = 0.5e-3,
    leakage_resistance: Scalar = LEAKAGE,
    coil_resistance: Scalar = COIL,
    valve_area: Scalar = math.pi / 4.0 * 4e-3**2,
    closing_time: Scalar = CLOSING_TIME,
    chamber_volume: Scalar = CHAMBER,
    bulk_modulus: Scalar = 1.5e9,
    density: Scalar = 1050.0,
    **others: Scalar,
) -> ValveHeldActuator:
    """The actuator that holds by its valve, within `band` in m around `position`. `others` go to `ehs_maxon`.

    The chamber between pump and valve holds the same liquid as the line, with the same losses of compression.
    """
    base = ehs_maxon(**others)
    stiffness = bulk_modulus / chamber_volume
    return ValveHeldActuator(
        supply=SignalVoltage(),
        demand=Constant(k=position),
        gauge=PositionSensor(),
        leak=LaminarResistance(resistance=leakage_resistance),
        controller=TwoPointController(bandwidth=band, is_on=1.0),  # opens at once
        drive=Gain(k=voltage),
        travel=FirstOrder(T=closing_time, x=1.0),
        chamber=Line(stiffness=stiffness, damping=stiffness * base.line.damping / base.line.stiffness),
        valve=OnOffValve(area=valve_area, density=density),
        **pump_parts(base),
        battery=ConstantVoltage(V=voltage),
        relay=IdealOpeningSwitch(),
        coil=Resistor(R=coil_resistance),
    )
