"""Rows of the designs, which are optima, prototypes or products; and the thesis' statements on ratios."""

import dataclasses
import functools as ft
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from acausal import parameters, replace
from acausal.design import Design, Front, Scale

from .._measured import measured
from .._output import prices_of
from ..actuators import (
    LARGEST_TORQUE,
    NO_LOAD_FRICTION,
    REDUCED_SUPPLY,
    STROKE,
    SUPPLY,
    WORN,
    WORN_LOAD,
    ClutchActuator,
    ehs_maxon,
    ema_fise,
    ema_maxon,
    holding_current,
    lift_share,
    spring_rate,
)
from ..validate._ratios import best_ratio, least_ratio
from ._concepts import ALLOWED, CONCEPTS, EHS, EHS_VALVE, EMA, MOTORS, Concept, Motor
from ._targets import HOLD, POWER, holding_energy, opening

_CURRENTS = ("holding current", "peak current")
HEADS = (
    "design", "motor", "opening time [ms]", "measured [ms]", "motor, held [A]", "measured [A]", "battery, held [A]",
    "power, held [W]", "holding energy [J]", "mass [kg]", "sizes",
)  # fmt: skip
DISTANCE_HEADS = (
    "prototype under 800 N", "opening time [ms]", "optimum within limits [ms]", "holding energy [J]",
    "minimum at equal time [J]", "violated limits",
)  # fmt: skip
# Short names and SI units of the variables, by path.
SHORT: Mapping[str, str] = {
    "gearbox.ratio": "ratio", "cam.profile.eccentricity": "eccentricity", "cam.profile.radius": "cam radius",
    "master.bore": "master", "slave.bore": "slave", "supply.V": "supply", "pump.displacement": "pump",
}  # fmt: skip
UNITS: Mapping[str, str] = {
    "cam.profile.eccentricity": "m", "cam.profile.radius": "m", "master.bore": "m", "slave.bore": "m", "supply.V": "V",
    "pump.displacement": "m3/rad",
}  # fmt: skip
STATEMENT_HEADS = ("statement", "thesis", "model", "remark")


@dataclasses.dataclass(frozen=True)
class Row:
    """A design under the load of 800 N, in SI units; measured values of the thesis are at 696 N.

    `holding_energy` is that of a hold of 10 s. `active` holds the multipliers of limits and bounds, in s per unit.
    """

    design: str
    motor: str
    opening_time: float
    thesis_opening_time: float | None
    holding_current: float
    thesis_holding_current: float | None
    holding_energy: float
    mass: float | None
    variables: Mapping[str, float] = dataclasses.field(default_factory=dict)  # of the model, by path
    active: Mapping[str, float] = dataclasses.field(default_factory=dict)
    kkt_residual: float | None = None
    status: str = ""
    remark: str = ""

    @property
    def holding_power(self) -> float:
        """Battery power in W during the hold."""
        return self.holding_energy / HOLD

    @property
    def battery_current(self) -> float:
        """Battery current in A during the hold."""
        return self.holding_power / SUPPLY


@dataclasses.dataclass(frozen=True)
class Statement:
    """A statement of the thesis on a ratio, and the result of the model."""

    statement: str
    thesis: float
    value: float
    remark: str


def prototypes(rtol: float = 1e-9) -> list[Row]:
    """Rows of the prototypes of 2012 with the spring of the test rig, with measured values, and with 800 N."""
    built: Sequence[tuple[str, str, Concept, ClutchActuator, Motor, float]] = (
        ("EMA", "ema_fise", EMA, ema_fise(), MOTORS[0], 2.5),
        ("EMA", "ema_maxon", EMA, ema_maxon(), MOTORS[1], 2.5),
        ("EHS", "ehs_maxon", EHS, ehs_maxon(), MOTORS[2], 1.8),
    )
    rows = []
    for kind, actuator, concept, model, motor, mass in built:
        figures = tuple(measured(actuator, quantity) for quantity in ("opening time", "holding current"))
        values = parameters(model)
        for name, rate, (time, current) in (
            ("rig's spring", spring_rate(model), figures),
            (f"{WORN_LOAD:g} N", WORN_LOAD / STROKE, (None, None)),
        ):  # fmt: skip
            loaded = replace(model, {"clutch.rate": rate})
            found = float(opening(loaded, rtol).t1)
            rows.append(
                Row(
                    f"{kind} of 2012, {name}", motor.name, found, time, float(holding_current(loaded)), current,
                    float(holding_energy(loaded)), mass, {path: float(values[path]) for path in concept.free},
                    remark="" if math.isfinite(found) else "does not open",
                )
            )  # fmt: skip
    return rows


@dataclasses.dataclass(frozen=True)
class Distance:
    """A prototype compared with the optimum of its concept with the same motor, under 800 N, in SI units.

    The best time is that within all limits. The best energy is that at the opening time of the prototype, without a
    limit on the current.
    """

    prototype: str
    opening_time: float
    best_opening_time: float
    holding_energy: float
    best_holding_energy: float
    breaks: str  # limits that the prototype violates


def distances(built: Sequence[Row]) -> list[Distance]:
    """The comparisons of the prototypes under 800 N."""
    found = []
    loaded = [row for row in built if "2012" in row.design and "spring" not in row.design]
    for row, concept, motor, model in zip(
        loaded, (EMA, EMA, EHS), MOTORS[:3], (ema_fise(), ema_maxon(), ehs_maxon()), strict=True
    ):
        limits = {name: limit for name, limit in concept.limits.items() if name not in _CURRENTS}
        cheapest = dataclasses.replace(concept, limits=limits).least_energy(motor, row.opening_time)
        found.append(
            Distance(
                f"{row.design.partition(',')[0]}, {motor.name}", row.opening_time, concept.solve(motor).objective,
                row.holding_energy, cheapest.objective, _broken(row, motor, model),
            )
        )  # fmt: skip
    return found


def _broken(row: Row, motor: Motor, model: Any) -> str:
    """The limits that a prototype violates."""
    worn = lift_share(model, WORN) if hasattr(model, "cam") else 0.0
    figures = (
        ("rated power", motor.power, POWER, "W"), ("holding current", row.holding_current, 20.0, "A"),
        ("peak current", float(model.supply.V / model.motor.resistor.R), 70.0, "A"),
        ("lift, worn clutch", float(worn), 1.0, ""),
    )  # fmt: skip
    return ", ".join(f"{name} {value:.3g} {unit}".strip() for name, value, limit, unit in figures if value > limit)


def distance_cells(found: Iterable[Distance]) -> list[tuple[str, ...]]:
    """The table cells as text."""
    return [
        (
            one.prototype, _text(one.opening_time, 1e3), _text(one.best_opening_time, 1e3), _text(one.holding_energy),
            _text(one.best_holding_energy), one.breaks or "-",
        )
        for one in found
    ]  # fmt: skip


def optimum(concept: Concept, motor: Motor, design: Design[Any], name: str = "") -> Row:
    """The row of an optimum."""
    time = next((r.value for r in design.results if r.limit.name == "target"), design.objective)
    return Row(
        name or concept.name, motor.name, time, None,
        math.nan if concept.valve else float(holding_current(design.model)), None, concept.holding_energy(design.model),
        concept.mass(motor), design.values, design.multipliers, design.kkt_residual, design.status, _prices(design),
    )  # fmt: skip


def _prices(design: Design[Any]) -> str:
    """The active limits with their multipliers, or the limits in conflict."""
    if design.conflict:
        return f"in conflict: {', '.join(design.conflict)}"
    return prices_of(design)


def solved(concept: Concept, motor: Motor) -> Row | None:
    """The optimum of a concept with a motor; None if no design opens the clutch."""
    try:
        design = concept.solve(motor)
    except RuntimeError:
        return None
    return optimum(concept, motor, design)


def optima() -> list[tuple[Concept, Motor]]:
    """The concepts and motors to optimise."""
    return [(concept, motor) for concept in CONCEPTS for motor in ALLOWED]


def with_less_friction() -> Row:
    """The optimum of the electrohydraulic actuator with the no-load set."""
    motor = dataclasses.replace(MOTORS[2], values={**MOTORS[2].values, "motor.bearing.C": NO_LOAD_FRICTION})
    return optimum(EHS_VALVE, motor, EHS_VALVE.solve(motor), "EHS, valve holds, no-load set")


def statements(rtol: float = 1e-9) -> list[Statement]:
    """The statements of the thesis on its two ratios, compared with the model, with other sizes fixed and free."""
    free = EMA.solve(MOTORS[1]).values["gearbox.ratio"]
    fise = EMA.solve(MOTORS[0]).values["gearbox.ratio"]
    return [
        Statement(
            "minimum ratio 1/11, FISE", 11.0, least_ratio(ema_fise(), LARGEST_TORQUE, STROKE),
            "reproduced if the motor torque is limited to 12 N.m/38, half its stall torque at 13.5 V",
        ),
        Statement(
            "minimum ratio 1/11, FISE", 11.0, least_ratio(ema_fise(), _stall_torque(ema_fise()), STROKE),
            "not reproduced with the stall torque at 13.5 V",
        ),
        Statement(
            "minimum ratio 1/11, FISE", 11.0, fise,
            "not optimal with all sizes free and a limit of 20 A: a larger ratio needs less holding current",
        ),
        Statement(
            "best ratio 1/4, RE50", 4.0, best_ratio(ft.partial(ema_maxon, voltage=REDUCED_SUPPLY), rtol),
            "reproduced at 70 % of the voltage, 9.45 V",
        ),
        Statement(
            "best ratio 1/4, RE50", 4.0, best_ratio(ema_maxon, rtol),
            "not reproduced at 13.5 V, where a smaller ratio is optimal",
        ),
        Statement(
            "best ratio 1/4, RE50", 4.0, free,
            "reproduced at 13.5 V and 800 N with all sizes free and a holding current of 20 A, which sets the ratio",
        ),
    ]  # fmt: skip


def _stall_torque(model: Any) -> float:
    return float(model.motor.emf.k * model.supply.V / model.motor.resistor.R)


def cells(rows: Iterable[Row]) -> Iterable[tuple[str, ...]]:
    """The table cells as text."""
    for row in rows:
        yield (
            row.design, row.motor, _text(row.opening_time, 1e3), _text(row.thesis_opening_time, 1e3),
            _text(row.holding_current), _text(row.thesis_holding_current), _text(row.battery_current),
            _text(row.holding_power), _text(row.holding_energy), _text(row.mass), built(row),
        )  # fmt: skip


def built(row: Row) -> str:
    """The variables of a design in display units."""
    return ", ".join(
        f"{SHORT.get(path, path)} {scale.value(value):.4g}{scale.text}"
        for path, value in row.variables.items()
        for scale in [Scale.of(UNITS.get(path, "1"))]
    )


def on_front(concept: Concept, motor: Motor, front: Front[Any]) -> list[Row]:
    """The rows of a front."""
    return [optimum(concept, motor, design, f"{concept.name}, front") for design in front.designs]


def prices(rows: Iterable[Row]) -> str:
    """The active limits of each optimum with their multipliers, as text."""
    return "\n".join(f"{row.design}, {row.motor}: {row.remark}" for row in rows if row.remark)


def _text(value: float | None, factor: float = 1.0) -> str:
    return "-" if value is None or not math.isfinite(value) else f"{factor * value:.4g}"
