"""The optimisation problems: free parameters, limits and starts."""

import dataclasses
import functools as ft
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import jax.numpy as jnp

from acausal import Scalar, Solution, replace
from acausal.design import Design, optimise
from components.catalogues import catalogue

from ..actuators import (
    STROKE,
    SUPPLY,
    WORN,
    ClutchActuator,
    ehs_maxon,
    ema_fise,
    ema_maxon,
    holding_current,
    lift_share,
    opening,
    pressure_angle,
)

HOLD = 60.0  # s
RE50 = catalogue("motors")["370354"]


@dataclasses.dataclass(frozen=True)
class Problem:
    """Minimisation of the opening time of an actuator."""

    name: str
    model: ClutchActuator
    free: Mapping[Any, Any]
    limits: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    start: Sequence[Mapping[str, Any]] = ()
    starts: int = 1

    def solve(self, rtol: float = 1e-9) -> Design:
        """The best design of all starts."""
        return optimise(
            self.model, self.free, {"opening time": (lambda s: s.t1, "ms")}, run=ft.partial(self.opening, rtol=rtol),
            constraints=self.limits, start=list(self.start), starts=self.starts,
        )  # fmt: skip

    def opening(self, model: ClutchActuator, rtol: float) -> Solution:
        """The run until the clutch is open, with peak values if there are limits."""
        return opening(model, save="end", rtol=rtol, throw=True, peaks=largest if self.limits else None)


def largest(s: Any) -> dict[str, Scalar]:
    """The quantities whose peak values have limits."""
    return {"current": s.motor.p.i, "pressure": s.line.p, "speed": s.motor.rotor.w}


def winding_rise(model: Any) -> Scalar:
    """Temperature rise in K of the winding above the housing after a hold of `HOLD`."""
    power = model.motor.resistor.R * holding_current(model) ** 2
    return RE50["winding_to_housing"] * power * (1.0 - jnp.exp(-HOLD / RE50["winding_time_constant"]))


def _limits(**changes: str) -> dict[str, Any]:
    """The limits of the electromechanical actuator by name."""
    functions: dict[str, Callable[[Any], Any]] = {
        "peak current": lambda s: s.peaks["current"].value,
        "holding current": lambda s: holding_current(s.final),
        "line pressure": lambda s: s.peaks["pressure"].value,
        "motor speed": lambda s: s.peaks["speed"].value,
        "winding": lambda s: winding_rise(s.final),
        "pressure angle": lambda s: pressure_angle(s.final),
        "lift": lambda s: lift_share(s.final, STROKE),
        "lift, worn clutch": lambda s: lift_share(s.final, WORN),
    }
    return {name.replace("_", " "): (functions[name.replace("_", " ")], text) for name, text in changes.items()}


def _by_factor(path: str, value: float) -> list[dict[str, float]]:
    """Starts at a third of a value and at three times the value."""
    return [{path: value / 3.0}, {path: value * 3.0}]


_DISPLACEMENT = float(ehs_maxon().pump.displacement)
_FOUR = {"gearbox.ratio": (1.5, 12.0), "cam.profile.eccentricity": ("3 mm", "12 mm"), "supply.V": (6.0, SUPPLY)}
_BEGIN = replace(
    ema_maxon(),
    {"gearbox.ratio": 4.4, "master.bore": 13.3e-3, "cam.profile.eccentricity": 11.7e-3, "supply.V": 12.4},
)
_OTHERS = {"peak_current": "<= 38 A", "line_pressure": "<= 32 bar", "pressure_angle": "<= 30 deg", "lift": "<= 1"}

PROBLEMS = (
    Problem(
        "EMA, FISE: ratio", ema_fise(), {"gearbox.ratio": (1.5, 40.0)}, start=_by_factor("gearbox.ratio", 12.0)
    ),
    Problem(
        "EMA, RE50: ratio", ema_maxon(), {"gearbox.ratio": (1.2, 20.0)}, start=_by_factor("gearbox.ratio", 4.3)
    ),
    Problem(
        "EHS, RE40: displacement", ehs_maxon(), {"pump.displacement": ("0.25 cm3/rev", "6.25 cm3/rev")},
        start=_by_factor("pump.displacement", _DISPLACEMENT),
    ),
    Problem(
        "EMA, RE50: four variables", _BEGIN, {**_FOUR, "master.bore": ("10 mm", "13.65 mm")},
        _limits(**_OTHERS, holding_current="<= 12 A"),
    ),
    Problem(
        "EMA, RE50: lower holding current", _BEGIN, {**_FOUR, "master.bore": ("10 mm", "14 mm")},
        _limits(**_OTHERS, holding_current="<= 11 A"),
    ),
    Problem(
        "EMA, RE50: six variables", ema_maxon(),
        {
            **_FOUR, "master.bore": ("12 mm", "20 mm"), "slave.bore": ("14 mm", "22 mm"),
            "cam.profile.radius": ("15 mm", "25 mm"),
        },
        {
            **_limits(
                peak_current="<= 38 A", holding_current="<= 10 A", line_pressure="<= 32 bar", motor_speed="<= 1500 rpm",
                winding="<= 20 K",
            ),
            "lift, worn clutch": (lambda s: lift_share(s.final, WORN), "<= 1"),
        },
        starts=10,
    ),
)  # fmt: skip
