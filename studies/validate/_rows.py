"""The model's figures for all that is compared: one row for each quantity, condition and source."""

import dataclasses
import functools as ft
from collections.abc import Callable
from types import MappingProxyType

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from acausal import Solution

from .._opening import STROKE, opening
from ..actuators import ClutchActuator, ehs_maxon, ema_fise, ema_maxon, sila
from ._statics import hold, mode_frequencies
from ._thesis import UNITS, Statement

ACTUATORS: MappingProxyType[str, Callable[..., ClutchActuator]] = MappingProxyType(
    {"sila": sila, "ema_fise": ema_fise, "ema_maxon": ema_maxon, "ehs_maxon": ehs_maxon}
)


@dataclasses.dataclass(frozen=True)
class Row:
    """A figure of the thesis, None where it is silent, and that of the model."""

    actuator: str
    quantity: str
    condition: str
    source: str
    unit: str
    thesis: float | None
    model: float

    @property
    def deviation(self) -> float | None:
        """Of the model, relative to the thesis."""
        return None if self.thesis is None else self.model / self.thesis - 1.0


def compare(statement: Statement, rtol: float = 1e-9) -> Row:
    """The model's figure beside that of the thesis."""
    unit = UNITS[statement.quantity]
    value = _value(statement, rtol)
    return Row(
        statement.actuator, statement.quantity, statement.condition, statement.source, unit, statement.value, value
    )


def run(actuator: str, changes: tuple[tuple[str, float], ...] = (), rtol: float = 1e-9) -> Solution:
    """An actuator as it opens the clutch."""
    return opening(ACTUATORS[actuator](**dict(changes)), rtol=rtol)


def _value(statement: Statement, rtol: float) -> float:
    if statement.quantity == "opening_time":
        return float(run(statement.actuator, statement.changes, rtol).t1)
    if statement.quantity == "peak_current":
        return float(jnp.max(jnp.abs(run(statement.actuator, statement.changes, rtol).motor.p.i)))
    if statement.quantity == "holding_current":
        return float(hold(ACTUATORS[statement.actuator](**dict(statement.changes)), STROKE).current)
    modes = _modes(statement.actuator, statement.changes, statement.loaded)
    return float(modes[int(statement.quantity[-1]) - 1])


@ft.cache
def _modes(actuator: str, changes: tuple[tuple[str, float], ...], loaded: bool) -> Float[np.ndarray, " modes"]:
    return mode_frequencies(ACTUATORS[actuator](**dict(changes)), 0.5 * STROKE, loaded=loaded)
