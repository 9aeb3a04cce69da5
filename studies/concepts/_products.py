"""Choice of products: all combinations of motors, gearheads or pump, standard bores, eccentricities and holds."""

import functools as ft
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import jax.numpy as jnp

from acausal import Scalar, Solution, replace
from acausal.design import Choice, choose

from ..actuators import STROKE, WORN_LOAD, holding_current
from ..catalogue import GEARHEADS, PUMPS, RTOL, bores
from ..catalogue import speed as speed_of_sheet
from ._concepts import EHS, EHS_VALVE, EMA, MOTORS
from ._rows import Row
from ._targets import CAM, COIL_POWER, HOLD, POWER, TARGET, VALVE_MASS, opening

HEADS = ("product", "motor", "parts", "opening time [ms]", "holding energy [J]", "mass [kg]")
Tables = Mapping[str, Sequence[Mapping[str, object]]]
Parts = Mapping[str, Mapping[str, float]]  # figures by table

# Motors without a stated mass are omitted.
_MOTORS = [
    {"name": motor.name, "motor.bearing.C": MOTORS[1].values["motor.bearing.C"], **motor.values}
    | {"figures": {"power": motor.power, "mass": motor.mass, "gearhead": motor.gearhead}}
    for motor in MOTORS
    if motor.mass is not None
]
_HELD = [
    {"name": "motor", "figures": {"valve": 0.0}},
    {"name": "valve", "figures": {"valve": 1.0}},
]
# Cams are made to order, in steps of a quarter of a millimetre.
_ECCENTRICITIES = [{"name": f"{n / 4:g} mm", "cam.profile.eccentricity": n / 4 * 1e-3} for n in range(12, 29)]
TABLES: Mapping[str, Tables] = {
    "EMA": {
        "motor": _MOTORS, "gearhead": GEARHEADS, "master": bores("master.bore", 11, 16),
        "slave": bores("slave.bore", 11, 12), "eccentricity": _ECCENTRICITIES,
    },
    "EHS": {"motor": _MOTORS, "pump": PUMPS, "slave": bores("slave.bore", 9, 14), "held by": _HELD},
}  # fmt: skip


def _has_valve(parts: Parts) -> Scalar:
    return parts["held by"]["valve"] if "held by" in parts else 0.0


def mass(s: Solution, parts: Parts) -> Scalar:
    """The total mass in kg."""
    is_ema = hasattr(s.final, "cam")
    rest = EMA.rest + parts["motor"]["gearhead"] if is_ema else EHS.rest + (EHS.pump_mass or 0.0)
    return parts["motor"]["mass"] + rest + VALVE_MASS * _has_valve(parts)


def current(s: Solution, parts: Parts) -> Scalar:
    """The holding current of the motor in A; zero if a valve holds."""
    return holding_current(s.final) * (1.0 - _has_valve(parts))


def energy(s: Solution, parts: Parts) -> Scalar:
    """The energy of a hold in J."""
    model: Any = s.final
    return HOLD * (model.motor.resistor.R * current(s, parts) ** 2 + COIL_POWER * _has_valve(parts))


def _of_cam(name: str) -> tuple[Callable[[Solution], Scalar], str]:
    """A limit of the cam; actuators without a cam satisfy it."""
    function, text = CAM[name]
    return lambda s: function(s) if hasattr(s.final, "cam") else 0.0, text


MINIMISE = {"opening time": (lambda s: s.t1, "ms"), "holding energy": (energy, "J"), "mass": (mass, "kg")}
LIMITS = {
    **TARGET,
    "rated power": (lambda s, parts: parts["motor"]["power"] + 0.0 * s.t1, f"<= {POWER} W"),
    "holding current": (current, "<= 20 A"),
    "peak current": CAM["peak current"],
    "line pressure": CAM["line pressure"],
    "rated speed": (speed_of_sheet, "<= 1"),
    "pressure angle": _of_cam("pressure angle"),
    "lift, worn clutch": _of_cam("lift, worn clutch"),
}


def study() -> Choice:
    """Evaluates all combinations."""
    worn = {"clutch.rate": WORN_LOAD / STROKE}
    models = {"EMA": replace(EMA.model, worn), "EHS": replace(EHS_VALVE.model, worn)}
    return choose(models, TABLES, MINIMISE, run=ft.partial(opening, rtol=RTOL), constraints=LIMITS)


def front(choice: Choice) -> list[Row]:
    """The Pareto-optimal products in time, energy and mass, the fastest first."""
    return [_row(choice, i) for i in choice.front]


def _row(choice: Choice, i: int) -> Row:
    parts = choice.combination(i)
    time, spent, kg = choice.values[i].tolist()
    by_valve = parts.get("held by") == "valve"
    amperes = jnp.nan if by_valve else holding_current(choice.model(i))
    what = ", ".join(f"{name} {part}" for name, part in parts.items() if name not in ("structure", "motor"))
    return Row(
        f"product, {parts['structure']}", parts["motor"], time, None, float(amperes), None, spent, kg, remark=what
    )


def cells(rows: Iterable[Row]) -> list[tuple[str, ...]]:
    """The table cells as text."""
    return [
        (
            row.design, row.motor, row.remark, f"{1e3 * row.opening_time:.4g}", f"{row.holding_energy:.4g}",
            f"{row.mass:.3g}",
        )
        for row in rows
    ]  # fmt: skip
