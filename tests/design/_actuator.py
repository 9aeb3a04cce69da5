"""The clutch actuator with the RE50 motor, its limits, and reference optima.

The reference figures were computed apart from this library: equations of motion by Radau IIA collocation with five
stages, the opening time by Newton's method, derivatives by complex steps, so that T is accurate to 1e-14 s.
"""

from typing import Any

import jax.numpy as jnp

from acausal import Solution, simulate
from studies.actuators import ElectromechanicalActuator, ema_maxon

STROKE = 12e-3
VARIABLES = ("gearbox.ratio", "master.bore", "cam.profile.eccentricity", "supply.V")


def free(widest_bore: str) -> dict[str, Any]:
    bounds = ((1.5, 12.0), ("10 mm", widest_bore), ("3 mm", "12 mm"), (6.0, 13.5))
    return dict(zip(VARIABLES, bounds, strict=True))


def start() -> ElectromechanicalActuator:
    return ema_maxon(ratio=4.4, master_bore=13.3e-3, eccentricity=11.7e-3, voltage=12.4)


def opening(model: Any) -> Solution:
    return simulate(model, 5.0, until=lambda s: s.slave.rod.s - STROKE, save="end", rtol=1e-10)


def held(model: Any) -> tuple[Any, Any]:
    """Lift of the cam and current in A of the motor that hold the clutch open, without friction."""
    profile = model.cam.profile
    pressure = model.clutch.rate * STROKE / model.slave.area
    lift = (model.slave.area * STROKE + pressure / model.line.stiffness) / model.master.area
    # lift = -e cos + sqrt(R^2 - e^2 sin^2) - (R - e), solved for the angle's cosine
    e, R = profile.eccentricity, profile.radius
    u = lift + R - e
    cos = (R**2 - e**2 - u**2) / (2.0 * u * e)
    slope = profile.slope(jnp.arccos(cos))
    return lift, pressure * model.master.area * slope / (model.gearbox.ratio * model.motor.emf.k)


def limits(hold_current: str) -> dict[str, Any]:
    return {
        "peak current": (lambda s: s.final.supply.V / s.final.motor.resistor.R, "<= 38 A"),
        "holding current": (lambda s: held(s.final)[1], f"<= {hold_current}"),
        "line pressure": (lambda s: s.final.line.p, "<= 32 bar"),
        "pressure angle": (lambda s: _pressure_angle(s.final.cam.profile), "<= 30 deg"),
        "lift": (lambda s: 1.01 * held(s.final)[0] / (2.0 * s.final.cam.profile.eccentricity), "<= 1"),
    }


def _pressure_angle(profile: Any) -> Any:
    return jnp.arcsin(profile.eccentricity / profile.radius)
