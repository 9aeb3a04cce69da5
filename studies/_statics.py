"""The open clutch at rest: what holds it, without friction, and what that asks of a cam."""

from typing import Any

import jax.numpy as jnp

from acausal import Scalar

from ._opening import STROKE
from .actuators import ClutchActuator

WORN = 1.08 * STROKE  # m, of the slave with a worn clutch
RESERVE = 1.01  # of the cam's lift


def line_pressure(model: ClutchActuator, stroke: Scalar = STROKE) -> Scalar:
    """In Pa, with the slave at a stroke."""
    return model.clutch.rate * stroke / model.slave.area


def held(model: Any, stroke: Scalar = STROKE) -> tuple[Scalar, Scalar]:
    """Lift of the cam and current in A of the motor that hold the slave at a stroke."""
    profile = model.cam.profile
    e, radius = profile.eccentricity, profile.radius
    pressure = line_pressure(model, stroke)
    lift = (model.slave.area * stroke + pressure / model.line.stiffness) / model.master.area
    # lift = -e cos(angle) + sqrt(radius^2 - (e sin(angle))^2) - (radius - e)
    reach = lift + radius - e
    cos = (radius**2 - e**2 - reach**2) / (2.0 * reach * e)
    slope = profile.slope(jnp.arccos(cos))
    return lift, pressure * model.master.area * slope / (model.gearbox.ratio * model.motor.emf.k)


def holding_current(model: Any) -> Scalar:
    """In A, of a motor behind a cam or a pump."""
    if hasattr(model, "cam"):
        return held(model)[1]
    return line_pressure(model) * model.pump.displacement / model.motor.emf.k


def lift_share(model: Any, stroke: Scalar) -> Scalar:
    """The share of the cam's lift that a stroke needs."""
    return RESERVE * held(model, stroke)[0] / (2.0 * model.cam.profile.eccentricity)


def pressure_angle(model: Any) -> Scalar:
    """The largest one of the cam, in rad."""
    return jnp.arcsin(model.cam.profile.eccentricity / model.cam.profile.radius)
