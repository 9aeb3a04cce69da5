"""Components from order names."""

import functools as ft
import inspect
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from acausal import ParameterError

from .._data_sheet import DataSheet
from ..electrical import BrushedMotor, DCMotor
from ..hydraulic import HoldingValve, Pump
from ..rotational import EqualMeshLoss, PlanetaryGearbox, PlanetaryTrain
from ._table import Catalogue, Column, load

COLUMNS: Mapping[str, Mapping[str, Column]] = {
    "motors": {
        "nominal_voltage": Column("V", 1.0, 1000.0, needed=True),
        "no_load_speed": Column("rad/s", 1.0, 1e4),
        "no_load_current": Column("A", 0.0, 100.0),
        "nominal_speed": Column("rad/s", 1.0, 1e4),
        "nominal_torque": Column("N.m", 1e-5, 1e3),
        "nominal_current": Column("A", 1e-3, 1e3),
        "stall_torque": Column("N.m", 1e-5, 1e4),
        "stall_current": Column("A", 1e-3, 1e4),
        "resistance": Column("ohm", 1e-3, 1e4, needed=True),
        "inductance": Column("H", 1e-7, 1.0),
        "torque_constant": Column("N.m/A", 1e-4, 10.0, needed=True),
        "inertia": Column("kg.m2", 1e-10, 1.0, needed=True),
        "winding_to_housing": Column("K/W", 1e-3, 1e3),
        "housing_to_ambient": Column("K/W", 1e-3, 1e3),
        "winding_time_constant": Column("s", 0.1, 1e4),
        "motor_time_constant": Column("s", 1.0, 1e5),
        "max_winding_temperature": Column("K", 323.15, 523.15),
        "max_speed": Column("rad/s", 1.0, 1e5),
        "mass": Column("kg", 1e-4, 1e3),
    },
    "gearheads": {
        "ratio": Column("1", 1.0, 1e4, needed=True),
        "stages": Column("1", 1.0, 6.0, needed=True),
        "efficiency": Column("1", 0.1, 1.0, needed=True),
        "continuous_torque": Column("N.m", 1e-3, 1e4),
        "intermittent_torque": Column("N.m", 1e-3, 1e4),
        "max_input_speed": Column("rad/s", 1.0, 1e4),
        "inertia": Column("kg.m2", 1e-10, 1.0),
        "mass": Column("kg", 1e-4, 1e3),
    },
    "pumps": {
        "displacement": Column("m3/rad", 1e-9, 1e-3, needed=True),
        "max_speed": Column("rad/s", 1.0, 1e4),
        "max_pressure": Column("Pa", 1e4, 1e9),
        "mass": Column("kg", 1e-3, 1e4),
    },
    "valves": {
        "nominal_voltage": Column("V", 1.0, 1000.0, needed=True),
        "nominal_current": Column("A", 1e-3, 100.0, needed=True),
        "max_pressure": Column("Pa", 1e5, 1e9, needed=True),
        "rated_flow": Column("m3/s", 1e-8, 1.0),
        "rated_drop": Column("Pa", 1e2, 1e8),
        "mass": Column("kg", 1e-3, 1e3),
    },
    # Currents of three phases are rms values, resistance and inductance are those between two terminals.
    "servo_motors": {
        "dc_voltage": Column("V", 1.0, 2000.0),
        "torque_constant": Column("N.m/A", 1e-4, 100.0, needed=True),
        "voltage_constant": Column("V.s/rad", 1e-4, 100.0),
        "resistance": Column("ohm", 1e-4, 1e4, needed=True),
        "inductance": Column("H", 1e-7, 1.0, needed=True),
        "pole_pairs": Column("1", 1.0, 100.0, needed=True),
        "inertia": Column("kg.m2", 1e-10, 100.0, needed=True),
        "continuous_torque": Column("N.m", 1e-5, 1e5),
        "continuous_current": Column("A", 1e-3, 1e4),
        "peak_torque": Column("N.m", 1e-5, 1e5),
        "peak_current": Column("A", 1e-3, 1e4),
        "no_load_speed": Column("rad/s", 1.0, 1e5),
        "max_speed": Column("rad/s", 1.0, 1e5),
        "winding_to_ambient": Column("K/W", 1e-3, 1e3),
        "motor_time_constant": Column("s", 1.0, 1e5),
        "max_winding_temperature": Column("K", 323.15, 523.15),
        "mass": Column("kg", 1e-3, 1e4),
    },
    "inverters": {
        "supply_voltage": Column("V", 1.0, 2000.0),
        "switching_frequency": Column("Hz", 100.0, 1e6),
        "rated_current": Column("A", 1e-3, 1e4, needed=True),
        "overload_current": Column("A", 1e-3, 1e4),
        "overload_time": Column("s", 1e-3, 1e4),
        "peak_current": Column("A", 1e-3, 1e4, needed=True),
        "peak_time": Column("s", 1e-3, 1e4),
    },
}


@ft.cache
def catalogue(name: str) -> Catalogue:
    """A catalogue of the library, by a name from `COLUMNS`: `catalogue("motors")`. For your own, see `load`."""
    return load(Path(__file__).parent / f"{name}.csv", COLUMNS[name])


def sheet_of(order: str | DataSheet, name: str) -> DataSheet:
    return order if isinstance(order, DataSheet) else catalogue(name)[order]


def dc_motor(order: str | DataSheet, **others: Any) -> DCMotor:
    """A motor from its order name or data sheet, at constant temperature.

    Viscous friction accounts for the no-load current, C = k I_0/w_0; if the sheet does not state it, there is none.
    `others` replace arguments of `DCMotor`.
    """
    sheet = sheet_of(order, "motors")
    k, current, speed = sheet["torque_constant"], sheet.get("no_load_current"), sheet.get("no_load_speed")
    friction = None if current is None or speed is None else k * current / speed
    given: dict[str, Any] = dict(
        R=sheet["resistance"], k=k, J=sheet["inertia"], L=sheet.get("inductance"), friction=friction
    )
    return DCMotor(**(given | others), data_sheet=sheet)


def brushed_motor(order: str | DataSheet, **others: Any) -> BrushedMotor:
    """A motor from its order name or data sheet, with heating; raises `ParameterError` without thermal figures.

    The heat capacities are time constant over thermal resistance, from winding to housing and from housing to ambient.
    Constant friction accounts for the no-load current: T_h = k I_0. `others` replace arguments of `BrushedMotor`.
    """
    sheet = sheet_of(order, "motors")
    inner, outer = sheet["winding_to_housing"], sheet["housing_to_ambient"]
    given: dict[str, Any] = dict(
        R=sheet["resistance"], k=sheet["torque_constant"], J=sheet["inertia"], L=sheet.get("inductance"),
        winding=sheet["winding_time_constant"] / inner, housing=sheet["motor_time_constant"] / outer,
        G_wh=1.0 / inner, G_ha=1.0 / outer, T_h=sheet["torque_constant"] * (sheet.get("no_load_current") or 0.0),
    )  # fmt: skip
    return BrushedMotor(**(given | others), data_sheet=sheet)


def gearhead(order: str | DataSheet, **others: Any) -> PlanetaryGearbox:
    """A planetary gearhead from its order name or data sheet, as one stage; connect its ring to `Fixed`.

    The mesh loss follows from the efficiency of the sheet, which is that from sun to carrier with the ring held,
    (1 + (N - 1) eta)/N. The inertia turns with the sun. The sheet does not state backlash and stiffness. `others`
    replace arguments of `PlanetaryGearbox`.
    """
    sheet = sheet_of(order, "gearheads")
    loss = EqualMeshLoss(efficiency=_rolling(sheet["ratio"], sheet["efficiency"]))
    given: dict[str, Any] = dict(ratio=sheet["ratio"], loss=loss, J_sun=sheet.get("inertia") or 0.0)
    return PlanetaryGearbox(**(given | others), data_sheet=sheet)


def gear_train(order: str | DataSheet, **others: Any) -> PlanetaryTrain:
    """A planetary gearhead from its order name or data sheet, with its number of stages.

    The sheet states the total ratio and efficiency: each of n stages has their n-th root. The inertia turns with the
    first sun. `others` are the other arguments of `PlanetaryTrain`.
    """
    sheet = sheet_of(order, "gearheads")
    number = round(sheet["stages"])
    ratio, efficiency = sheet["ratio"] ** (1.0 / number), sheet["efficiency"] ** (1.0 / number)
    loss = EqualMeshLoss(efficiency=_rolling(ratio, efficiency))
    first = PlanetaryGearbox(ratio=ratio, loss=loss, J_sun=sheet.get("inertia") or 0.0)
    stages = [first, *(PlanetaryGearbox(ratio=ratio, loss=loss) for _ in range(number - 1))]
    return PlanetaryTrain(stages=stages, data_sheet=sheet, **others)


def _rolling(ratio: float, efficiency: float) -> float:
    """Efficiency of the meshes with the carrier held, from the efficiency from sun to carrier with the ring held."""
    return (ratio * efficiency - 1.0) / (ratio - 1.0)


def pump(order: str | DataSheet, **others: Any) -> Pump:
    """A pump from its order name or data sheet, without losses; `others` replace arguments of `Pump`."""
    sheet = sheet_of(order, "pumps")
    given: dict[str, Any] = dict(displacement=sheet["displacement"])
    return Pump(**(given | others), data_sheet=sheet)


def holding_valve(order: str | DataSheet, **others: Any) -> HoldingValve:
    """A normally open valve from its order name or data sheet, built by `HoldingValve.rated`.

    The sheet gives voltage and current of the coil, pressure, flow and pressure drop, as far as it states them.
    `others` add or replace arguments of `HoldingValve.rated`. Raises `ParameterError` if an argument is missing.
    """
    sheet = sheet_of(order, "valves")
    stated = dict(
        voltage="nominal_voltage", current="nominal_current", pressure="max_pressure", flow="rated_flow",
        drop="rated_drop",
    )  # fmt: skip
    given: dict[str, Any] = {name: sheet.get(figure) for name, figure in stated.items()}
    given = {name: value for name, value in given.items() if value is not None} | others
    taken = inspect.signature(HoldingValve.rated).parameters.values()
    if missing := [one.name for one in taken if one.default is inspect.Parameter.empty and one.name not in given]:
        name = missing[0]
        raise ParameterError(f"{sheet.catalogue}, {sheet.order}: {name} is not stated. Give it: {name}=...")
    return HoldingValve.rated(**given, data_sheet=sheet)
