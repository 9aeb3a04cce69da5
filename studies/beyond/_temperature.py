"""What the temperature does: to the opening time by liquid, winding and magnets, and to how often a motor may open.

A pipe of a metre holds the liquid whose viscosity changes; friction of seals and bearings stays what it was when
identified. Thermal figures are those of the data sheet of the RE 40.
"""

import dataclasses
import functools as ft
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp

from acausal import Component, Connections, Scalar, connect, replace, simulate
from components.catalogues import DataSheet, brushed_motor, catalogue
from components.electrical import BrushedMotor, ConstantCurrent, Ground
from components.hydraulic import LaminarResistance, Line, dot_4
from components.rotational import Fixed
from components.thermal import FixedTemperature

from .._opening import opening
from .._statics import holding_current
from .._warm import SHEETS, magnets, winding
from ..actuators import ClutchActuator, ehs_maxon
from ._line import DIAMETER, LongLine
from ._prototypes import PROTOTYPES, RE40, RE50, Build
from ._row import Row

ITEM = "temperature"
LENGTH = 1.0  # m, of the pipe
TEMPERATURES = (-30.0, 0.0, 25.0, 80.0, 120.0)  # degC
LATEST = 2.0  # s, given up after this time
ORDER = "148867"  # RE 40, 24 V
HOLDS = (0.0, 1.0, 10.0)  # s
HOT = 80.0  # degC, beside an engine
ACTUATORS = {name: PROTOTYPES[name].build for name in (RE50, RE40)}


@ft.cache
def _sheet() -> DataSheet:
    return catalogue("motors")[ORDER]


def at_temperature(build: Build, liquid: Scalar, motor: Scalar) -> ClutchActuator:
    """An actuator with a pipe, whose liquid and motor have temperatures in K."""
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
    """Opening times where all is as warm, and where only the liquid is."""
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
    """What a motor may do for ever in an ambient."""

    per_minute: float  # operations
    heat: float  # J, in the winding, of an operation
    opening: float  # s, of the hot actuator
    winding: float  # K
    housing: float  # K


def allowed(ambient: float, hold: float, valve: bool = False, rtol: float = 1e-8) -> Allowed:
    """How often the EHS may open and hold so that its winding stays below its limit in the mean.

    The winding of resistance R_w at its limit gives T_max - T_ambient = P (1/G_wh + 1/G_ha); an operation puts the heat
    of the opening and of the hold into it. The heat of closing, of 4 J at most, and that of the pump are left out.
    """
    sheet, built = _sheet(), ehs_maxon()
    inner, outer = sheet["winding_to_housing"], sheet["housing_to_ambient"]
    limit = sheet["max_winding_temperature"]
    power = (limit - ambient) / (inner + outer)
    housing = ambient + power * outer
    resistance = sheet["resistance"] * winding(limit)
    k = sheet["torque_constant"] * magnets(housing)
    # What was identified beyond the winding of the data sheet is that of leads and brushes.
    leads = built.motor.resistor.R - sheet["resistance"]
    model = replace(built, {"motor.resistor.R": resistance + leads, "motor.emf.k": k})
    opened = opening(model, t_max=LATEST, rtol=rtol, integrals=lambda s: {"heat": s.motor.p.i**2})
    current = float(holding_current(model))
    heat = float(resistance * (opened.integrals["heat"][-1] + (0.0 if valve else hold * current**2)))
    time = float(opened.t1)
    return Allowed(min(60.0 * power / heat, 60.0 / (time + hold)), heat, time, limit, housing)


class Warming(Component):
    """The motor as it warms, its shaft held, at the current that has the mean heat of the operations."""

    source: ConstantCurrent
    motor: BrushedMotor
    ambient: FixedTemperature
    ground: Ground = Ground()
    wall: Fixed = Fixed()

    def connections(self) -> Connections:
        return (
            connect(self.source.p, self.motor.p),
            connect(self.source.n, self.motor.n, self.ground.p),
            connect(self.motor.shaft, self.wall.flange),
            connect(self.motor.ambient, self.ambient.port),
        )


def time_to_limit(per_minute: float, one: Allowed, ambient: float) -> float:
    """After how many s the winding reaches its limit, from the ambient's temperature on; infinite where it does not."""
    current = (per_minute / 60.0 * one.heat / (_sheet()["resistance"] * winding(one.winding))) ** 0.5
    motor = brushed_motor(ORDER, L=None, T=ambient)
    model = Warming(
        source=ConstantCurrent(I=-current), motor=motor, ambient=FixedTemperature(temperature=ambient)
    )  # fmt: skip
    found = simulate(
        model, 4.0 * 3600.0, until=lambda s: s.motor.winding.T - one.winding, save="end", rtol=1e-7, throw=False
    )
    return float(found.t1)


def thermal_rows(rtol: float = 1e-8) -> list[Row]:
    """Operations per minute by ambient, hold, and what holds."""
    rows = []
    for celsius in (25.0, HOT):
        for hold in HOLDS:
            for name, valve in (("motor", False), ("valve", True)):
                one = allowed(celsius + 273.15, hold, valve, rtol)
                case = f"EHS, RE40, {celsius:g} C, {hold:g} s held by its {name}"
                bound = "no pause between them" if one.per_minute > 59.9 / (one.opening + hold) else ""
                rows.append(Row(ITEM, case, "operations allowed", "1/min", one.per_minute, remark=bound))
                rows.append(Row(ITEM, case, "heat of an operation", "J", one.heat))
    one = allowed(HOT + 273.15, 1.0, rtol=rtol)
    rows.append(Row(ITEM, f"EHS, RE40, at its thermal limit, {HOT:g} C", "opening time", "s", one.opening))
    for share in (1.2, 1.5, 2.0):
        case = f"EHS, RE40, {HOT:g} C, 1 s held by its motor, {share:g} times what is allowed"
        late = time_to_limit(share * one.per_minute, one, HOT + 273.15)
        rows.append(Row(ITEM, case, "time to the limit", "s", late))
    return rows


def rows(rtol: float = 1e-8) -> list[Row]:
    """All of it."""
    return [*opening_rows(rtol), *thermal_rows(rtol)]
