"""The designs that are optimised: free parameters, limits and starts."""

import dataclasses
import functools as ft
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import jax.numpy as jnp

from acausal import Scalar, Solution, simulate
from acausal.design import Design, optimise

from .._opening import LONGEST, STROKE
from ..actuators import ClutchActuator, ehs_maxon, ema_fise, ema_maxon

WORN = 1.08 * STROKE  # m, of the slave with a worn clutch
RESERVE = 1.01  # of the cam's lift
HOLD = 60.0  # s
# Of the RE50, Maxon's data sheet: thermal resistance from the winding to the housing, and the winding's time constant.
WINDING_RESISTANCE = 1.2  # K/W
WINDING_TIME = 71.7  # s


@dataclasses.dataclass(frozen=True)
class Problem:
    """The least opening time of an actuator."""

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
        """The run until the clutch is open; with the largest values on the way, where there are limits."""
        return simulate(
            model, LONGEST, until=lambda s: s.slave.rod.s - STROKE, save="end", rtol=rtol,
            peaks=largest if self.limits else None,
        )  # fmt: skip


def largest(s: Any) -> dict[str, Scalar]:
    """Of which the largest values are limited."""
    return {"current": s.motor.p.i, "pressure": s.line.p, "speed": s.motor.rotor.w}


def held(model: Any, stroke: Scalar = STROKE) -> tuple[Scalar, Scalar]:
    """Lift of the cam and current in A of the motor that hold the slave at a stroke, without friction."""
    profile = model.cam.profile
    e, radius = profile.eccentricity, profile.radius
    pressure = model.clutch.rate * stroke / model.slave.area
    lift = (model.slave.area * stroke + pressure / model.line.stiffness) / model.master.area
    # lift = -e cos(angle) + sqrt(radius^2 - (e sin(angle))^2) - (radius - e)
    reach = lift + radius - e
    cos = (radius**2 - e**2 - reach**2) / (2.0 * reach * e)
    slope = profile.slope(jnp.arccos(cos))
    return lift, pressure * model.master.area * slope / (model.gearbox.ratio * model.motor.emf.k)


def winding_rise(model: Any) -> Scalar:
    """By how much the winding in K gets warmer than the housing while the clutch is held open for `HOLD`."""
    power = model.motor.resistor.R * held(model)[1] ** 2
    return WINDING_RESISTANCE * power * (1.0 - jnp.exp(-HOLD / WINDING_TIME))


def _reserve(model: Any, stroke: Scalar) -> Scalar:
    """The share of the cam's lift that a stroke needs."""
    return RESERVE * held(model, stroke)[0] / (2.0 * model.cam.profile.eccentricity)


def _limits(**changes: str) -> dict[str, Any]:
    """Limits of the electromechanical actuator, by name."""
    functions: dict[str, Callable[[Any], Any]] = {
        "peak current": lambda s: s.peaks["current"].value,
        "holding current": lambda s: held(s.final)[1],
        "line pressure": lambda s: s.peaks["pressure"].value,
        "motor speed": lambda s: s.peaks["speed"].value,
        "winding": lambda s: winding_rise(s.final),
        "pressure angle": lambda s: jnp.arcsin(s.final.cam.profile.eccentricity / s.final.cam.profile.radius),
        "lift": lambda s: _reserve(s.final, STROKE),
        "lift, worn clutch": lambda s: _reserve(s.final, WORN),
    }
    return {name.replace("_", " "): (functions[name.replace("_", " ")], text) for name, text in changes.items()}


def _by_factor(path: str, value: float) -> list[dict[str, float]]:
    """Starts at a third of a value and at three times it."""
    return [{path: value / 3.0}, {path: value * 3.0}]


_DISPLACEMENT = float(ehs_maxon().pump.displacement)
_FOUR = {"gearbox.ratio": (1.5, 12.0), "cam.profile.eccentricity": ("3 mm", "12 mm"), "supply.V": (6.0, 13.5)}
_START = [{"gearbox.ratio": 4.4, "master.bore": "13.3 mm", "cam.profile.eccentricity": "11.7 mm", "supply.V": 12.4}]
_OTHERS = {"peak_current": "<= 38 A", "line_pressure": "<= 32 bar", "pressure_angle": "<= 30 deg", "lift": "<= 1"}

PROBLEMS = (
    Problem(
        "EMA, FISE: ratio", ema_fise(), {"gearbox.ratio": (1.5, 40.0)}, start=_by_factor("gearbox.ratio", 12.0)
    ),
    Problem(
        "EMA, RE50: ratio", ema_maxon(), {"gearbox.ratio": (1.2, 20.0)}, start=_by_factor("gearbox.ratio", 4.3)
    ),
    Problem(
        "EHS, RE40: displacement", ehs_maxon(), {"pump.displacement": (0.2 * _DISPLACEMENT, 5.0 * _DISPLACEMENT)},
        start=_by_factor("pump.displacement", _DISPLACEMENT),
    ),
    Problem(
        "EMA, RE50: four variables", ema_maxon(master_bore=13.3e-3), {**_FOUR, "master.bore": ("10 mm", "13.65 mm")},
        _limits(**_OTHERS, holding_current="<= 12 A"), _START,
    ),
    Problem(
        "EMA, RE50: less current to hold", ema_maxon(master_bore=13.3e-3), {**_FOUR, "master.bore": ("10 mm", "14 mm")},
        _limits(**_OTHERS, holding_current="<= 11 A"), _START,
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
            "lift, worn clutch": (lambda s: _reserve(s.final, WORN), "<= 1"),
        },
        starts=10,
    ),
)  # fmt: skip
