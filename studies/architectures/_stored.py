"""Actuators whose motor is off during the hold: with a holding valve, a check valve, or an accumulator."""

from typing import Any

from acausal import Connections, connect, replace
from components.blocks import Constant, FirstOrder, Gain, Maximum, Product, SecondOrder, Switch, TwoPointController
from components.electrical import ConstantVoltage, IdealOpeningSwitch, Resistor, SignalVoltage
from components.hydraulic import (
    CheckValve,
    FixedPump,
    GasAccumulator,
    LaminarResistance,
    OnOffValve,
    PressureSensor,
    ReliefValve,
    Tank,
    ThreeWayValve,
    VariableOrifice,
    Volume,
)

from ..actuators import LEAKAGE, SUPPLY, valve_held
from ._parts import (
    Controlled,
    chamber,
    drain,
    drain_control,
    load,
    motor_control,
    pump_data,
    re40,
    relief,
    spool,
    three_way_valve,
    valve_control,
)

BAND = 0.5e-3  # m, between start and end of a top-up
CHARGED, CHARGING_BAND = 4.2e6, 2e5  # Pa, mean pressure of the accumulator and its band


class Leaking(Controlled, partial=True):
    """Motor and fixed pump with a tank. The seals of the slave leak, so that it must be topped up."""

    supply: SignalVoltage  # pyright: ignore[reportIncompatibleVariableOverride]
    pump: FixedPump
    leak: LaminarResistance
    drive: Gain
    tank: Tank = Tank()

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.motor.shaft, self.pump.shaft),
            connect(self.tank.port, self.pump.a),
            connect(self.line.b, self.leak.a),
            connect(self.leak.b, self.tank.port),
        )


class HoldingValveActuator(Leaking):
    """The prototype of the thesis: a normally open valve closes to hold the clutch.

    To close the clutch, the valve opens, and the motor follows the profile.
    """

    top_up: TwoPointController
    mode: Switch
    opens: Maximum
    travel: FirstOrder
    valve: OnOffValve
    chamber: Volume
    battery: ConstantVoltage
    relay: IdealOpeningSwitch
    coil: Resistor

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.demand.y, self.top_up.u_s),
            connect(self.gauge.y, self.top_up.u_m),
            connect(self.top_up.y, self.drive.u, self.opens.u1),
            connect(self.demand.closes, self.opens.u2, self.mode.control),
            connect(self.controller.y, self.mode.u1),
            connect(self.drive.y, self.mode.u2),
            connect(self.mode.y, self.supply.u),
            connect(self.opens.y, self.travel.u, self.relay.u),
            connect(self.travel.y, self.valve.u),
            connect(self.pump.b, self.chamber.port, self.valve.a),
            connect(self.valve.b, self.line.a),
            connect(self.battery.p, self.relay.p),
            connect(self.relay.n, self.coil.p),
            connect(self.coil.n, self.battery.n, self.ground.p),
        )


class PurgeActuator(Leaking):
    """A check valve holds. To close the clutch, the motor is off, and a purge valve returns the liquid to the tank."""

    top_up: TwoPointController
    idle: Constant
    mode: Switch
    opens: Product
    check: CheckValve
    chamber: Volume
    spool: SecondOrder
    purge: VariableOrifice

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.demand.y, self.top_up.u_s),
            connect(self.gauge.y, self.top_up.u_m),
            connect(self.idle.y, self.mode.u1),
            connect(self.top_up.y, self.mode.u2),
            connect(self.demand.closes, self.mode.control, self.opens.u1),
            connect(self.mode.y, self.drive.u),
            connect(self.drive.y, self.supply.u),
            connect(self.pump.b, self.chamber.port, self.check.a),
            connect(self.check.b, self.line.a, self.purge.a),
            connect(self.purge.b, self.tank.port),
            connect(self.controller.y, self.opens.u2),
            connect(self.opens.y, self.spool.u),
            connect(self.spool.y, self.purge.u),
        )


class AccumulatorActuator(Leaking):
    """As in automated gearboxes, an accumulator that a pump recharges supplies a three-way valve.

    One on/off valve connects the accumulator to the three-way valve, another one the three-way valve to the line. Both
    are closed during the hold, except to top up.
    """

    wanted: Constant
    sensor: PressureSensor
    charger: TwoPointController
    top_up: TwoPointController
    opens: Maximum
    travel: FirstOrder
    check: CheckValve
    chamber: Volume
    accumulator: GasAccumulator
    relief: ReliefValve
    inlet: OnOffValve
    spool: SecondOrder
    gallery: Volume
    valve: ThreeWayValve
    passage: Volume
    outlet: OnOffValve

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.wanted.y, self.charger.u_s),
            connect(self.sensor.y, self.charger.u_m),
            connect(self.charger.y, self.drive.u),
            connect(self.drive.y, self.supply.u),
            connect(self.demand.y, self.top_up.u_s),
            connect(self.gauge.y, self.top_up.u_m),
            connect(self.top_up.y, self.opens.u1),
            connect(self.demand.closes, self.opens.u2),
            connect(self.opens.y, self.travel.u),
            connect(self.travel.y, self.inlet.u, self.outlet.u),
            connect(self.pump.b, self.chamber.port, self.check.a),
            connect(self.check.b, self.accumulator.port, self.sensor.port, self.relief.a, self.inlet.a),
            connect(self.relief.b, self.valve.t, self.tank.port),
            connect(self.controller.y, self.spool.u),
            connect(self.spool.y, self.valve.u),
            connect(self.inlet.b, self.gallery.port, self.valve.p),
            connect(self.valve.a, self.passage.port, self.outlet.a),
            connect(self.outlet.b, self.line.a),
        )


def holding_valve() -> HoldingValveActuator:
    """The prototype of the thesis, with RE40 motor and pump of 1.25 cm3."""
    held = valve_held()
    return HoldingValveActuator(
        valve=held.valve, travel=held.travel, coil=held.coil, relay=held.relay, battery=held.battery, mode=Switch(),
        opens=Maximum(), controller=motor_control(), **_chambered(), **_leaking(),
    )  # fmt: skip


def purge_valve() -> PurgeActuator:
    """Motor, pump, check valve, and a proportional purge valve."""
    return PurgeActuator(
        check=_check(), idle=Constant(k=0.0), mode=Switch(), opens=Product(), spool=spool(), purge=drain(),
        controller=drain_control(), **_chambered(), **_leaking(),
    )  # fmt: skip


def automated_gearbox() -> AccumulatorActuator:
    """Three-way proportional valve with on/off valves and accumulator."""
    held = valve_held()
    model = AccumulatorActuator(
        wanted=Constant(k=CHARGED), sensor=PressureSensor(), charger=TwoPointController(bandwidth=CHARGING_BAND),
        opens=Maximum(), travel=held.travel, check=_check(), accumulator=_accumulator(), relief=relief(CHARGED + 5e5),
        inlet=held.valve, outlet=held.valve, spool=spool(), valve=three_way_valve(), gallery=_passage(),
        passage=_passage(), controller=valve_control(), **_chambered(), **_leaking(),
    )  # fmt: skip
    return charged(model)


def charged(model: AccumulatorActuator) -> AccumulatorActuator:
    """The model with the accumulator, whatever its size, and the parts connected to it at the mean pressure.

    The mean pressure is the middle of the charging band, where the pump is off and stays off for some time. The duty
    therefore begins away from all switching pressures.
    """
    gas = model.accumulator
    share = ((gas.precharge + gas.atmosphere) / (CHARGED + gas.atmosphere)) ** (1.0 / gas.n)
    return replace(model, {"accumulator.V": gas.volume * (1.0 - share), "gallery.p": CHARGED})


def _leaking() -> dict[str, Any]:
    return dict(
        supply=SignalVoltage(), motor=re40(), pump=FixedPump(**pump_data()), leak=LaminarResistance(resistance=LEAKAGE),
        drive=Gain(k=SUPPLY), **load(),
    )  # fmt: skip


def _chambered() -> dict[str, Any]:
    return dict(chamber=chamber(), top_up=TwoPointController(bandwidth=BAND))


def _check() -> CheckValve:
    return CheckValve(conductance=1e-9)


def _passage() -> Volume:
    return Volume(volume=1e-6, bulk_modulus=1.5e9)


def _accumulator() -> GasAccumulator:
    volume = 1e-4
    return GasAccumulator(capacity=0.8 * volume, resistance=1e9, volume=volume, precharge=3.0e6)
