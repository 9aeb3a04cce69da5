"""Valve-controlled actuators: a pump that turns all the time, and a valve that meters what the clutch gets."""

from typing import Any

from acausal import Connections, connect
from components.blocks import SecondOrder
from components.electrical import ConstantVoltage
from components.hydraulic import (
    BypassCompensator,
    FixedPump,
    LoadSensingPump,
    PressureCompensatedPump,
    ReliefValve,
    Tank,
    ThreeWayValve,
    VariableOrifice,
    Volume,
)

from ._parts import (
    HIGHEST,
    VOLTAGE,
    Controlled,
    chamber,
    drain,
    drain_control,
    load,
    pump_data,
    re40,
    relief,
    spool,
    three_way_valve,
    valve_control,
)

MARGIN = 7e5  # Pa, of load sensing above the load: the valve's drop at its rated flow, and the band
BAND = 3e5  # Pa, over which load sensing and pressure compensation act


class PumpSupplied(Controlled, partial=True):
    """The motor turns a pump at the voltage of the battery; the controller moves the spool of a valve."""

    supply: ConstantVoltage  # pyright: ignore[reportIncompatibleVariableOverride]
    pump: FixedPump | PressureCompensatedPump | LoadSensingPump
    spool: SecondOrder
    tank: Tank = Tank()

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.motor.shaft, self.pump.shaft),
            connect(self.tank.port, self.pump.a),
            connect(self.controller.y, self.spool.u),
        )


class Metered(PumpSupplied, partial=True):
    """A three-way valve joins the line with the pump to open, with the tank to close."""

    chamber: Volume
    valve: ThreeWayValve

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.spool.y, self.valve.u),
            connect(self.pump.b, self.chamber.port, self.valve.p),
            connect(self.valve.t, self.tank.port),
            connect(self.valve.a, self.line.a),
        )


class Relieved(Metered, partial=True):
    """A fixed pump, whose pressure a relief valve bounds."""

    pump: FixedPump  # pyright: ignore[reportIncompatibleVariableOverride]
    relief: ReliefValve

    def connections(self) -> Connections:
        return *super().connections(), connect(self.pump.b, self.relief.a), connect(self.relief.b, self.tank.port)


class ConstantPressureActuator(Relieved):
    """What the valve does not take goes through the relief valve."""


class LoadSensingActuator(Relieved):
    """A compensator lets the surplus go at a pressure that is a margin above that of the load."""

    compensator: BypassCompensator

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.pump.b, self.compensator.a),
            connect(self.compensator.b, self.tank.port),
            connect(self.compensator.load, self.line.a),
        )


class PressureCompensatedActuator(Metered):
    """The pump gives what the valve takes, at one pressure."""

    pump: PressureCompensatedPump  # pyright: ignore[reportIncompatibleVariableOverride]


class PowerMatchedActuator(Metered):
    """The pump gives what the valve takes, at a pressure that is a margin above that of the load."""

    pump: LoadSensingPump  # pyright: ignore[reportIncompatibleVariableOverride]

    def connections(self) -> Connections:
        return *super().connections(), connect(self.pump.load, self.line.a)


class BleedOffActuator(PumpSupplied):
    """The pump is on the line, and a valve bleeds off what the clutch does not take, at the pressure of the load."""

    bleed: VariableOrifice

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.spool.y, self.bleed.u),
            connect(self.pump.b, self.line.a, self.bleed.a),
            connect(self.bleed.b, self.tank.port),
        )


def constant_pressure() -> ConstantPressureActuator:
    """(1) Fixed pump, constant supply pressure."""
    return ConstantPressureActuator(pump=FixedPump(**pump_data()), relief=relief(), **_metered())


def load_sensing() -> LoadSensingActuator:
    """(2) Fixed pump, pressure matched by load sensing."""
    compensator = BypassCompensator(rated_flow=1e-4, rated_drop=5e5, band=BAND, margin=MARGIN)
    return LoadSensingActuator(pump=FixedPump(**pump_data()), relief=relief(), compensator=compensator, **_metered())


def pressure_compensated() -> PressureCompensatedActuator:
    """(3) Variable pump, flow matched."""
    pump = PressureCompensatedPump(tau=0.02, x=1.0, p_set=HIGHEST, band=BAND, **pump_data())
    return PressureCompensatedActuator(pump=pump, **_metered())


def power_matched() -> PowerMatchedActuator:
    """(4) Variable pump, pressure and flow matched."""
    pump = LoadSensingPump(tau=0.02, x=1.0, margin=MARGIN, band=BAND, p_set=HIGHEST, band_set=BAND, **pump_data())
    return PowerMatchedActuator(pump=pump, **_metered())


def bleed_off() -> BleedOffActuator:
    """(5) Fixed pump with bleed-off."""
    return BleedOffActuator(pump=FixedPump(**pump_data()), bleed=drain(), **_drive(), controller=drain_control())


def _drive() -> dict[str, Any]:
    return dict(supply=ConstantVoltage(V=VOLTAGE), motor=re40(), spool=spool(), **load())


def _metered() -> dict[str, Any]:
    return dict(chamber=chamber(), valve=three_way_valve(), controller=valve_control(), **_drive())
