"""Figures of Meloni's thesis (Politecnico di Torino, 2012) on the actuators, in SI units, each with its source."""

import dataclasses
import math

from .._measured import DEAD_TIME, FULL, MEASURED, REDUCED
from ..actuators import PRESENT_RATIO, STROKE, WORN_LOAD
from . import _reasons as why

QUANTITIES = (
    "opening_time", "peak_current", "holding_current", "holding_power", "battery_current", "mode_frequency_1",
    "mode_frequency_2",
)  # fmt: skip
WITH_CAM = ("ema_fise", "ema_maxon")  # with a nonlinear cam, so that the load changes the modes
# Kinds of figures of the thesis.
GIVEN = "given"  # used to choose the parameters of the set
PREDICTED = "predicted"  # predicted by the model with the set
REFITTED = "refitted"  # a parameter of the set, identified again from the measurements
NOT_COMPARABLE = "not comparable"  # the thesis and the set describe different things
KINDS = (GIVEN, PREDICTED, REFITTED, NOT_COMPARABLE)


@dataclasses.dataclass(frozen=True)
class Statement:
    """A figure of the thesis, or None, and the differences of its conditions from the base case."""

    actuator: str
    quantity: str
    value: float | None
    source: str
    changes: tuple[tuple[str, float], ...] = ()  # keywords of the design
    loaded: bool = False  # modes of the actuator held against its spring
    kind: str = PREDICTED
    reason: str = ""  # of a deviation of the model

    @property
    def condition(self) -> str:
        changes = [f"{name}={value:g}" for name, value in self.changes]
        return ", ".join(changes + ["held against the spring"] * self.loaded) or "base"


_RPM = math.pi / 30.0  # rad/s
_PRESENT_SPEED = 500.0 * PRESENT_RATIO * _RPM
_REDUCED = (("voltage", REDUCED),)
_STIFF = (("spring_rate", 1.2e5),)
_WORN = (("spring_rate", WORN_LOAD / STROKE),)
_FREE = (("friction", 0.0),)
_SHEET = (("voltage", 24.0),)
_BATTERY = (("voltage", 12.0),)


def _sides(quantity: str, motor: float, slave: float, source: str, kind: str = PREDICTED) -> tuple[Statement, ...]:
    name, mode = quantity.split("_")
    return tuple(
        Statement("sila", f"{name}_{side}_{mode}", value, source, _STIFF, kind=kind)
        for side, value in (("motor", motor), ("slave", slave))
    )


def _measured(actuator: str, quantity: str, voltage: float = FULL, **more: str) -> Statement:
    """A figure measured on a prototype."""
    data = {**MEASURED[actuator][voltage], **(DEAD_TIME if actuator == "ehs_maxon" else {})}
    datum = data[quantity.replace("_", " ")]
    changes = () if voltage == FULL else (("voltage", voltage),)
    return Statement(actuator, quantity, datum.value, f"{datum.source}, measured", changes, **more)  # pyright: ignore


LINEAR = (
    Statement("sila", "mass_motor", 5.37e3, "Table 4.1", _STIFF, kind=GIVEN),
    Statement("sila", "stiffness_liquid", 8.57e6, "Table 4.1", _STIFF, kind=GIVEN),
    Statement("sila", "mass_slave", 0.3, "Table 4.1", _STIFF, kind=GIVEN),
    Statement("sila", "stiffness_clutch", 1.2e5, "Table 4.1", _STIFF, kind=GIVEN),
    Statement("sila", "mode_frequency_1", 0.75, "Table 4.2, mechanical", _STIFF),
    Statement("sila", "mode_frequency_1", 0.744, "Table 4.2, bond graph", _STIFF),
    Statement("sila", "mode_frequency_2", 856.0, "Table 4.2, mechanical and bond graph", _STIFF),
    *_sides("kinetic_1", 0.999946, 0.000054, "Table 4.3"),
    *_sides("kinetic_2", 0.000054, 0.999946, "Table 4.3"),
    *_sides("displacement_1", 1.0, 1.0, "Table 4.4"),
    Statement("sila", "displacement_motor_2", 3.4e-4, "Table 4.4", _STIFF, reason=why.NOT_ORTHOGONAL),
    Statement("sila", "displacement_slave_2", 1.0, "Table 4.4", _STIFF),
    *_sides("potential_1", 0.0136, 0.9863, "Table 4.5"),
    *_sides("potential_2", 0.9863, 0.0136, "Table 4.5"),
    Statement("sila", "static_gain", 9.33e3, "chapter 4", _STIFF, kind=GIVEN),
    Statement("sila", "static_gain_level", 79.4, "chapter 4", _STIFF, kind=GIVEN),
    Statement("sila", "angle_per_stroke", 9.35e3, "chapter 4, ratio of input to output", _STIFF),
)

STATEMENTS = (
    *LINEAR,
    Statement("sila", "holding_current", 0.0, "section 6.1, held by the worm", kind=GIVEN),
    Statement("ema_fise", "opening_time", 0.140, "Fig. 6.6, simulated"),
    _measured("ema_fise", "opening_time", reason=why.SCATTER),
    Statement("ema_fise", "opening_time", 0.140, "concluding table"),
    _measured("ema_fise", "peak_current", reason=why.ABOVE_STALL),
    _measured("ema_fise", "holding_current", kind=GIVEN),
    Statement("ema_fise", "least_ratio", 11.0, "chapter 6, at 12 N.m behind 38:1"),
    Statement(
        "ema_fise", "no_load_speed", _PRESENT_SPEED, "Table 6.2, 500 rpm behind 38:1", _BATTERY + _FREE, kind=GIVEN,
        reason=why.NO_VOLTAGE,
    ),
    Statement(
        "ema_fise", "no_load_speed", _PRESENT_SPEED, "Table 6.2, 500 rpm behind 38:1", _BATTERY, kind=NOT_COMPARABLE,
        reason=why.OF_THE_DRIVE,
    ),
    Statement("ema_fise", "stall_torque", 0.606, "Table 6.2, 12 N.m behind 38:1, 52.1 %", _BATTERY),
    Statement("ema_fise", "identified_resistance", 0.133, "Table 8.1", kind=REFITTED, reason=why.REFITTED),
    Statement("ema_fise", "identified_friction", 16e-4, "Table 8.1", kind=REFITTED, reason=why.REFITTED),
    Statement("ema_maxon", "opening_time", 0.075, "Fig. 6.11, simulated", reason=why.TABLE_8_2),
    _measured("ema_maxon", "opening_time", reason=why.TABLE_8_2),
    _measured("ema_maxon", "peak_current", reason=why.ABOVE_STALL),
    _measured("ema_maxon", "holding_current", reason=why.HELD_BY_MORE),
    Statement("ema_maxon", "best_ratio", 4.0, "chapter 6, about", reason=why.FULL_VOLTAGE),
    _measured("ema_maxon", "opening_time", REDUCED, reason=why.TABLE_8_2),
    Statement("ema_maxon", "opening_time", 0.100, "concluding table", _REDUCED, reason=why.TABLE_8_2),
    _measured("ema_maxon", "peak_current", REDUCED, reason=why.ABOVE_STALL),
    Statement("ema_maxon", "best_ratio", 4.3, "chapter 6, as built", _REDUCED),
    Statement("ema_maxon", "no_load_speed", 5950.0 * _RPM, "concluding table, 5950 rpm", _SHEET + _FREE, kind=GIVEN),
    Statement(
        "ema_maxon", "no_load_speed", 5950.0 * _RPM, "concluding table, 5950 rpm", _SHEET, kind=NOT_COMPARABLE,
        reason=why.OF_THE_DRIVE,
    ),
    Statement("ema_maxon", "stall_torque", 8.92, "Table 6.3", _SHEET, kind=NOT_COMPARABLE, reason=why.OF_THE_DRIVE),
    Statement("ema_maxon", "identified_resistance", 0.309, "Table 8.2", kind=REFITTED, reason=why.REFITTED),
    Statement("ema_maxon", "identified_friction", 4e-3, "Table 8.2", kind=REFITTED, reason=why.REFITTED),
    Statement(
        "ehs_maxon", "opening_time", 0.070, "Fig. 6.14, simulated, friction guessed", kind=NOT_COMPARABLE,
        reason=why.GUESSED,
    ),
    _measured("ehs_maxon", "opening_time"),
    _measured("ehs_maxon", "dead_time", kind=NOT_COMPARABLE, reason=why.NO_STICKING),
    _measured("ehs_maxon", "peak_current", reason=why.ABOVE_STALL),
    Statement("ehs_maxon", "holding_current", 18.0, "Fig. 7.10, caption, measured", kind=GIVEN, reason=why.TWO_VALUES),
    Statement("ehs_maxon", "holding_current", 20.0, "chapter 7, text, measured, about", kind=GIVEN),
    Statement("ehs_maxon", "holding_pressure", 8e6, "section 6.4, for 800 N", _WORN, reason=why.NO_SUCH_PRESSURE),
    Statement("ehs_maxon", "no_load_speed", 7580.0 * _RPM, "Table 6.4, 7580 rpm", _SHEET + _FREE, kind=GIVEN),
    Statement(
        "ehs_maxon", "no_load_speed", 7580.0 * _RPM, "Table 6.4, 7580 rpm", _SHEET, kind=NOT_COMPARABLE,
        reason=why.OF_THE_DRIVE,
    ),
    Statement("ehs_maxon", "stall_torque", 2.28, "Table 6.4", _SHEET, kind=NOT_COMPARABLE, reason=why.OF_THE_DRIVE),
    Statement("ehs_maxon", "identified_resistance", 0.4, "Table 8.3", kind=REFITTED, reason=why.REFITTED),
    Statement("ehs_maxon", "identified_friction", 4e-3, "Table 8.3", kind=REFITTED, reason=why.REFITTED),
)  # fmt: skip


def statements(actuator: str) -> list[Statement]:
    """The comparisons of an actuator: each quantity of the base case, then further statements."""
    stated = [statement for statement in STATEMENTS if statement.actuator == actuator]
    base: list[Statement] = []
    for quantity in QUANTITIES:
        found = [item for item in stated if item.quantity == quantity and item.condition == "base"]
        base += found or [Statement(actuator, quantity, None, "")]
    loaded: list[Statement] = []
    if actuator in WITH_CAM:
        loaded = [Statement(actuator, f"mode_frequency_{i}", None, "", loaded=True) for i in (1, 2)]
    return base + [item for item in stated if item not in base] + loaded
