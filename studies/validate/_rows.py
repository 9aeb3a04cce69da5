"""The figures of the model: one row for each quantity, condition and source."""

import dataclasses
import functools as ft
import math
from collections.abc import Callable
from types import MappingProxyType

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from acausal import Solution

from .._vibrations import mode_frequencies
from ..actuators import (
    LARGEST_TORQUE,
    NO_LOAD_FRICTION,
    STROKE,
    ClutchActuator,
    ElectromechanicalActuator,
    ehs_maxon,
    ema_fise,
    ema_maxon,
    hold,
    opening,
    sila,
    spring_rate,
)
from ..prototypes._cases import CASES, fit
from ._linear import linear_actuator, modes, static_gains, travel, turning_inertia
from ._ratios import best_ratio, least_ratio
from ._statements import LINEAR, Statement
from ._words import UNITS

ACTUATORS: MappingProxyType[str, Callable[..., ClutchActuator]] = MappingProxyType(
    {"sila": sila, "ema_fise": ema_fise, "ema_maxon": ema_maxon, "ehs_maxon": ehs_maxon}
)

MOVED = 0.01  # of the stroke, threshold of motion
TOLERANCE = 0.05  # largest deviation of a reproduced figure
FRICTIONAL = ("opening_time", "dead_time")  # quantities of the EHS that depend on its friction
IDENTIFIED = 4  # parameters in each of tables 8.1 to 8.3


@dataclasses.dataclass(frozen=True)
class Row:
    """A figure of the thesis, or None, and that of the model."""

    actuator: str
    quantity: str
    condition: str
    source: str
    unit: str
    thesis: float | None
    model: float
    no_load: float | None  # figure of the model with the no-load set, if that set affects it
    kind: str  # given, predicted, refitted, not comparable
    reason: str  # of a deviation

    @property
    def deviation(self) -> float | None:
        """Relative deviation of the model from the thesis."""
        if self.thesis is None:
            return None
        if self.thesis == 0.0:
            return 0.0 if self.model == 0.0 else math.inf
        return self.model / self.thesis - 1.0

    @property
    def reproduced(self) -> bool | None:
        """Whether the deviation is within `TOLERANCE`."""
        return None if self.deviation is None else abs(self.deviation) <= TOLERANCE


def compare(statement: Statement, rtol: float = 1e-9) -> Row:
    """Computes the figure of the model for a figure of the thesis."""
    unit = UNITS[statement.quantity]
    value = _value(statement, rtol)
    return Row(
        statement.actuator, statement.quantity, statement.condition, statement.source, unit, statement.value, value,
        _no_load(statement, rtol), statement.kind, statement.reason,
    )  # fmt: skip


def _no_load(statement: Statement, rtol: float) -> float | None:
    """The figure of the model with the no-load set."""
    if statement.actuator != "ehs_maxon" or statement.quantity not in FRICTIONAL:
        return None
    changes = (*statement.changes, ("friction", NO_LOAD_FRICTION))
    return _value(dataclasses.replace(statement, changes=changes), rtol)


@ft.cache
def run(actuator: str, changes: tuple[tuple[str, float], ...] = (), rtol: float = 1e-9) -> Solution:
    """The run of an actuator that opens the clutch."""
    return opening(ACTUATORS[actuator](**dict(changes)), rtol=rtol)


def _value(statement: Statement, rtol: float) -> float:
    if statement in LINEAR:
        return _of_linear_model()[statement.quantity]
    name, changes = statement.actuator, statement.changes
    model = ACTUATORS[name](**dict(changes))
    match statement.quantity:
        case "opening_time":
            return float(run(name, changes, rtol).t1)
        case "dead_time":
            return float(opening(model, stroke=MOVED * STROKE, rtol=rtol).t1)
        case "peak_current":
            return float(jnp.max(jnp.abs(run(name, changes, rtol).motor.p.i)))
        case "holding_current":
            return float(hold(model, STROKE).current)
        case "holding_power":
            return float(hold(model, STROKE).power)
        case "battery_current":
            return float(hold(model, STROKE).battery_current())
        case "holding_pressure":
            return float(hold(model, STROKE).pressure)
        case "no_load_speed":
            return _free_speed(model, dict(changes)["voltage"])
        case "stall_torque":
            return float(model.motor.emf.k / model.motor.resistor.R) * dict(changes)["voltage"]
        case "identified_resistance":
            return _identified(name)["motor.resistor.R"]
        case "identified_friction":
            return _identified(name)["motor.bearing.C"]
        case "least_ratio":
            assert isinstance(model, ElectromechanicalActuator)
            return least_ratio(model, LARGEST_TORQUE, STROKE)
        case "best_ratio":
            return best_ratio(ft.partial(ACTUATORS[name], **dict(changes)), rtol)
    return float(_modes(name, changes, statement.loaded)[int(statement.quantity[-1]) - 1])


def _free_speed(model: ClutchActuator, voltage: float) -> float:
    """No-load speed of the motor in rad/s, at which its torque k (V - k w) / R equals its friction C w."""
    k, bearing = model.motor.emf.k, model.motor.bearing
    friction = 0.0 if bearing is None else bearing.C
    return float(k * voltage / (k**2 + model.motor.resistor.R * friction))


@ft.cache
def _identified(actuator: str) -> dict[str, float]:
    """The parameters of tables 8.1 to 8.3 identified from the measurements."""
    found = fit(next(case for case in CASES if case.actuator == actuator and len(case.free) == IDENTIFIED))
    return dict(zip(found.names, found.estimates.tolist(), strict=True))


@ft.cache
def _modes(actuator: str, changes: tuple[tuple[str, float], ...], loaded: bool) -> Float[np.ndarray, " modes"]:
    return mode_frequencies(ACTUATORS[actuator](**dict(changes)), 0.5 * STROKE, loaded=loaded)


@ft.cache
def _of_linear_model() -> dict[str, float]:
    """The results of chapter 4 of the thesis on the present actuator, by the names of `UNITS`."""
    model = linear_actuator()
    actuator, moved = model.actuator, travel(model.actuator)
    gain, ratio = static_gains(model)
    found = {
        "mass_motor": turning_inertia(actuator) / moved**2,
        "mass_slave": float(actuator.piston.m),
        "stiffness_liquid": float(actuator.line.stiffness * actuator.slave.area**2),
        "stiffness_clutch": float(spring_rate(actuator)),
        "static_gain": gain,
        "static_gain_level": 20.0 * np.log10(gain),
        "angle_per_stroke": ratio,
    }
    for number, mode in enumerate(modes(model), start=1):
        found[f"mode_frequency_{number}"] = mode.frequency
        for name, share in (("kinetic", mode.kinetic), ("potential", mode.potential), ("displacement", mode.shape)):
            # The thesis prints the magnitudes of displacements.
            found |= {f"{name}_motor_{number}": abs(share.motor), f"{name}_slave_{number}": abs(share.slave)}
    return found
