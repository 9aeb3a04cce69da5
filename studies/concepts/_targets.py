"""Targets of the thesis as limits of a design, and the objectives."""

from collections.abc import Callable
from typing import Any

from acausal import Scalar, Solution, replace

from ..actuators import (
    COIL,
    STROKE,
    SUPPLY,
    WORN,
    ClutchActuator,
    ema_fise,
    holding_current,
    lift_share,
    line_pressure,
    pressure_angle,
)
from ..actuators import opening as run_until_open

OVERALL, HYDRAULIC = 0.2, 0.1  # s, target opening times of all actuators, and of the electrohydraulic one
POWER = 250.0  # W, largest rated power of a motor
HOLD = 10.0  # s, duration of a hold
LONGEST = 1.0  # s, limit of a run
COIL_POWER = SUPPLY**2 / COIL  # W, holding valve of the thesis at full voltage; 19.4 W at 12 V
VALVE_MASS = 0.29  # kg, with its coil

_CAM = ema_fise().cam


def cam_inertia(profile: Any) -> Scalar:
    """Inertia of an eccentric disc, J ~ R^2 (R^2/2 + e^2) at constant thickness, scaled from the thesis' cam."""

    def size(profile: Any) -> Scalar:
        return profile.radius**2 * (0.5 * profile.radius**2 + profile.eccentricity**2)

    return _CAM.J * size(profile) / size(_CAM.profile)


def opening(model: Any, rtol: float = 1e-9) -> Solution:
    """The run until the clutch is open, with the peak speed of the motor. The inertia of a cam depends on its size."""
    if hasattr(model, "cam"):
        model = replace(model, {"cam.J": cam_inertia(model.cam.profile)})
    return run_until_open(model, t_max=LONGEST, save="end", rtol=rtol, peaks=lambda s: {"speed": s.motor.rotor.w})


def holding_energy(model: ClutchActuator) -> Scalar:
    """The energy in J of a hold by the motor."""
    return HOLD * model.motor.resistor.R * holding_current(model) ** 2


def _of_model(function: Callable[..., Scalar], *others: Scalar) -> Callable[[Solution], Scalar]:
    return lambda s: function(s.final, *others)


def motor_speed(s: Solution) -> Scalar:
    return s.peaks["speed"].value


OPENING_TIME = {"opening time": (lambda s: s.t1, "ms")}
HOLDING_ENERGY = {"holding energy": (_of_model(holding_energy), "J")}
TARGET = {"target": (lambda s: s.t1, f"<= {1e3 * OVERALL} ms")}
BY_MOTOR = {"holding current": (_of_model(holding_current), "<= 20 A")}
ANY = {
    "peak current": (lambda s: s.final.supply.V / s.final.motor.resistor.R, "<= 70 A"),
    "line pressure": (_of_model(line_pressure), "<= 40 bar"),
}
CAM = ANY | {
    "motor speed": (motor_speed, "<= 6000 rpm"),  # of the gearhead GP 52
    "pressure angle": (_of_model(pressure_angle), "<= 30 deg"),
    "lift": (_of_model(lift_share, STROKE), "<= 1"),
    "lift, worn clutch": (_of_model(lift_share, WORN), "<= 1"),
}
PUMP = ANY | {"motor speed": (motor_speed, "<= 5000 rpm")}  # of the pump UK 0.5 D
