"""Effect of the temperature on the opening time, through liquid, winding and magnets, and on the allowed operations.

The viscosity of the liquid acts in a pipe of one metre. The friction of seals and bearings stays at its identified
value. Thermal data are those of the data sheets of RE 40 and RE 50; the FISE has none.
"""

import dataclasses
import itertools
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp

from acausal import Scalar, replace
from components.catalogues import brushed_motor, catalogue
from components.hydraulic import LaminarResistance, Line, dot_4

from ..actuators import SHEETS, ClutchActuator, holding_current, magnets, opening, winding
from ._cycles import COLD, Cycle
from ._line import DIAMETER, LongLine
from ._prototypes import PROTOTYPES, RE40, RE50, Build
from ._row import Row

ITEM = "temperature"
LENGTH = 1.0  # m, length of the pipe
TEMPERATURES = (-30.0, 0.0, 25.0, 80.0, 120.0)  # degC
LATEST = 2.0  # s, limit of a run
ORDERS: Mapping[str, str] = MappingProxyType({RE40: "148867", RE50: "370354"})  # of the motors, 24 V
HOLDERS: Mapping[str, tuple[str, ...]] = MappingProxyType({RE40: ("motor", "valve"), RE50: ("motor",)})
HOLDS = (0.0, 1.0, 10.0)  # s
HOT = 80.0  # degC, near an engine
ACTUATORS = {name: PROTOTYPES[name].build for name in (RE50, RE40)}


def at_temperature(build: Build, liquid: Scalar, motor: Scalar) -> ClutchActuator:
    """An actuator with a pipe, with the temperatures of liquid and motor in K."""
    base, oil, cool = build(), dot_4(liquid), dot_4(293.15)
    stiffness = base.line.stiffness * oil.bulk_modulus_at(1e6) / cool.bulk_modulus_at(1e6)
    viscosity = oil.reference_density * oil.kinematic_viscosity(0.0)
    drop = LaminarResistance.from_pipe(diameter=DIAMETER, length=LENGTH, viscosity=viscosity)
    line = LongLine(spring=Line(stiffness=stiffness, damping=base.line.damping), pipe=drop)
    warmed = dataclasses.replace(base, line=line)
    values = {
        "motor.resistor.R": base.motor.resistor.R * winding(motor),
        "motor.emf.k": base.motor.emf.k * magnets(motor),
    }
    return replace(warmed, values)


@eqx.filter_jit
def _time(model: ClutchActuator, rtol: float) -> Scalar:
    return opening(model, t_max=LATEST, save="end", rtol=rtol, max_steps=50_000).t1


def opening_rows(
    rtol: float = 1e-8, actuators: Mapping[str, Build] = ACTUATORS, temperatures: Sequence[float] = TEMPERATURES
) -> list[Row]:
    """Rows of the opening times with all parts at a temperature, and with only the liquid at it."""
    rows = []
    for name, build in actuators.items():
        for celsius in temperatures:
            kelvin = celsius + 273.15
            for what, motor in (("all", kelvin), ("liquid alone", SHEETS)):
                time = float(_time(at_temperature(build, jnp.asarray(kelvin), jnp.asarray(motor)), rtol))
                rows.append(Row(ITEM, f"{name}, {what} at {celsius:g} C", "opening time", "s", time))
    for celsius in temperatures:
        nu = float(dot_4(celsius + 273.15).kinematic_viscosity(0.0))
        rows.append(Row(ITEM, f"DOT 4 at {celsius:g} C", "viscosity", "m2/s", nu))
    return rows


class Allowed(NamedTuple):
    """The operations that a motor can repeat indefinitely."""

    per_minute: float  # operations; zero if the first operation exceeds the limit
    cycle: Cycle
    limit: float  # K, limit of the winding temperature
    heat: float  # J, winding heat of an operation at the limit


def allowed(name: str, ambient: float, hold: float, valve: bool = False, rtol: float = 1e-8) -> Allowed:
    """The rate at which a prototype can open and hold without exceeding the limit of its winding.

    The opening starts with the winding at its limit, and with magnets at the steady temperature of the housing for this
    winding temperature. The heat of the closing, at most 4 J with the pump, and that of the pump are neglected.
    """
    sheet, built = catalogue("motors")[ORDERS[name]], PROTOTYPES[name].build()
    inner, outer, limit = (
        sheet[name] for name in ("winding_to_housing", "housing_to_ambient", "max_winding_temperature")
    )
    housing = ambient + (limit - ambient) * outer / (inner + outer)
    resistance = sheet["resistance"] * winding(limit)
    k = sheet["torque_constant"] * magnets(housing)
    # The identified resistance beyond that of the data sheet belongs to leads and brushes.
    leads = built.motor.resistor.R - sheet["resistance"]
    model = replace(built, {"motor.resistor.R": resistance + leads, "motor.emf.k": k})
    opened = opening(model, t_max=LATEST, rtol=rtol, integrals=lambda s: {"heat": s.motor.p.i**2})
    burst = float(resistance * opened.integrals["heat"][-1])
    current = 0.0 if valve else float(holding_current(model))
    cycle = Cycle(brushed_motor(sheet, L=None, T=ambient), ambient, float(opened.t1), burst, current, hold)
    heat = burst + float(resistance) * current**2 * hold
    return Allowed(60.0 / cycle.shortest_period(limit), cycle, limit, heat)


def thermal_rows(rtol: float = 1e-8) -> list[Row]:
    """Rows of the winding heat and the allowed operations by prototype, ambient, hold, and holding part."""
    rows = []
    for name, celsius, hold in itertools.product(ORDERS, (25.0, HOT), HOLDS):
        for holder in HOLDERS[name]:
            one = allowed(name, celsius + 273.15, hold, holder == "valve", rtol)
            case = f"{name}, {celsius:g} C, {hold:g} s held by its {holder}"
            once = one.cycle.warmest(COLD) - 273.15
            rows += [
                Row(ITEM, case, "operations allowed", "1/min", one.per_minute, remark=_bound(one)),
                Row(ITEM, case, "winding after the first operation", "degC", once),
                Row(ITEM, case, "winding heat per operation", "J", one.heat),
            ]
    for name in ORDERS:
        one = allowed(name, HOT + 273.15, 1.0, rtol=rtol)
        rows.append(Row(ITEM, f"{name}, at its thermal limit, {HOT:g} C", "opening time", "s", one.cycle.opening))
    one = allowed(RE40, HOT + 273.15, 1.0, rtol=rtol)
    for share in (1.2, 1.5, 2.0):
        case = f"{RE40}, {HOT:g} C, 1 s held by its motor, {share:g} times the allowed rate"
        late = one.cycle.time_to(one.limit, 60.0 / (share * one.per_minute))
        rows.append(Row(ITEM, case, "time to the limit", "min", late / 60.0))
    return rows


def _bound(one: Allowed) -> str:
    """The limit of the number of operations, if it is not the heat of many operations."""
    if one.per_minute == 0.0:
        return f"the first operation heats the winding above {one.limit - 273.15:.0f} C"
    return "without a pause" if one.per_minute > 59.9 / one.cycle.shortest else ""


def rows(rtol: float = 1e-8) -> list[Row]:
    """All rows."""
    return [*opening_rows(rtol), *thermal_rows(rtol)]
