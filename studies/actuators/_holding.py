"""Electrohydraulic actuators that hold the clutch open, by the motor or by a valve.

Actuator and valve are those of Meloni's thesis (Politecnico di Torino, 2012); the valve is an Atlantic CEBP with coil
M7. The thesis does not state the leakage of the seals, the liquid volume between pump and valve, and the closing time
of the valve. These values are assumed.
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
CLOSING_TIME = 1e-3  # s, time constant of the valve; assumed
CHAMBER = 1e-6  # m3, between pump and valve; assumed
COIL = 12.0 / 1.62  # ohm, of the thesis' holding valve (Atlantic CEBP with coil M7: 19.4 W)


class HoldingActuator(PumpActuator, partial=True):
    """The electrohydraulic actuator with leakage from the slave cylinder and a position controller."""

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
    """The actuator that is held by its motor: a PI controller sets the motor voltage within the battery voltage.

    The converter between battery and motor is lossless: the battery power equals the motor power.
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
    """The actuator that is held by a normally open valve: while its coil closes the valve, the motor is off.

    When the slave has sunk too far, a two-point controller opens the valve and runs the motor at full voltage. When it
    is off, the motor is short-circuited, which brakes it. The valve follows its coil with a lag. A valve that closed
    instantly would stop the turning pump against the small volume in front of it, and both would ring. Not modelled is
    cavitation in the chamber, for about a millisecond, while the pump still turns backwards as the valve closes.
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
    """The actuator that is held by its motor; `gain` in V/m. `others` are keywords of `ehs_maxon`."""
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
    """The actuator that is held by a valve, within `band` in m around `position`. `others` are keywords of `ehs_maxon`.

    The chamber between pump and valve contains the same liquid as the line, with the same compression losses.
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
