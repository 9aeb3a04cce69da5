"""Valve-controlled actuators: a pump that turns continuously, and a valve that meters the flow to the clutch."""

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

from ..actuators import SUPPLY
from ._parts import (
    HIGHEST,
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

MARGIN = 7e5  # Pa, load-sensing margin: the pressure drop of the valve at its rated flow, and the band
ABOVE = 1e6  # Pa, setting of relief valves above that of variable pumps
SWING = 0.02  # s, time constant of a swash plate
BAND = 3e5  # Pa, over which load sensing and pressure compensation act


class PumpSupplied(Controlled, partial=True):
    """The motor turns a pump at battery voltage; the controller moves the spool of a valve."""

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
    """A three-way valve connects the line to the pump to open, and to the tank to close.

    A relief valve limits the supply pressure. With a fixed pump, it sets this pressure. A variable pump needs it while
    its swash plate swings back.
    """

    chamber: Volume
    valve: ThreeWayValve
    relief: ReliefValve

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.spool.y, self.valve.u),
            connect(self.pump.b, self.chamber.port, self.valve.p, self.relief.a),
            connect(self.valve.t, self.relief.b, self.tank.port),
            connect(self.valve.a, self.line.a),
        )


class ConstantPressureActuator(Metered):
    """The surplus flow returns through the relief valve."""

    pump: FixedPump  # pyright: ignore[reportIncompatibleVariableOverride]


class LoadSensingActuator(Metered):
    """A compensator returns the surplus flow at the load pressure plus a margin."""

    pump: FixedPump  # pyright: ignore[reportIncompatibleVariableOverride]
    compensator: BypassCompensator

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.pump.b, self.compensator.a),
            connect(self.compensator.b, self.tank.port),
            connect(self.compensator.load, self.line.a),
        )


class PressureCompensatedActuator(Metered):
    """The pump delivers the flow of the valve at constant pressure."""

    pump: PressureCompensatedPump  # pyright: ignore[reportIncompatibleVariableOverride]


class PowerMatchedActuator(Metered):
    """The pump delivers the flow of the valve at the load pressure plus a margin."""

    pump: LoadSensingPump  # pyright: ignore[reportIncompatibleVariableOverride]

    def connections(self) -> Connections:
        return *super().connections(), connect(self.pump.load, self.line.a)


class BleedOffActuator(PumpSupplied):
    """The pump supplies the line directly, and a valve bleeds off the surplus flow at the load pressure."""

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
    return ConstantPressureActuator(pump=FixedPump(**pump_data()), **_metered())


def load_sensing() -> LoadSensingActuator:
    """(2) Fixed pump, pressure matched by load sensing."""
    compensator = BypassCompensator(rated_flow=1e-4, rated_drop=5e5, band=BAND, margin=MARGIN)
    return LoadSensingActuator(pump=FixedPump(**pump_data()), compensator=compensator, **_metered())


def pressure_compensated() -> PressureCompensatedActuator:
    """(3) Variable pump, flow matched."""
    pump = PressureCompensatedPump(tau=SWING, x=1.0, p_set=HIGHEST, band=BAND, **pump_data())
    return PressureCompensatedActuator(pump=pump, **_metered(ABOVE))


def power_matched() -> PowerMatchedActuator:
    """(4) Variable pump, pressure and flow matched."""
    pump = LoadSensingPump(tau=SWING, x=1.0, margin=MARGIN, band=BAND, p_set=HIGHEST, band_set=BAND, **pump_data())
    return PowerMatchedActuator(pump=pump, **_metered(ABOVE))


def bleed_off() -> BleedOffActuator:
    """(5) Fixed pump with bleed-off."""
    return BleedOffActuator(pump=FixedPump(**pump_data()), bleed=drain(), **_drive(), controller=drain_control())


def _drive() -> dict[str, Any]:
    return dict(supply=ConstantVoltage(V=SUPPLY), motor=re40(), spool=spool(), **load())


def _metered(above: float = 0.0) -> dict[str, Any]:
    return dict(
        chamber=chamber(), valve=three_way_valve(), relief=relief(HIGHEST + above), controller=valve_control(),
        **_drive(),
    )  # fmt: skip
