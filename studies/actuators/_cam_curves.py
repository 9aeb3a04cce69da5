"""Lift, pressure angle and torque of a cam against its clutch, as in figures 8.1 to 8.3 of the thesis."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from acausal import ArgumentError

from ._models import ClutchActuator
from ._opening import STROKE
from ._statics import hold


class CamCurves(NamedTuple):
    """Static cam curves over the travel of the slave: arrays in SI units."""

    stroke: Array  # m, of the slave
    angle: Array  # rad, of the cam
    lift: Array  # m
    pressure_angle: Array  # rad, between the direction of motion of the follower and the force on it
    torque: Array  # N.m, of the follower on the cam


def cam_curves(model: ClutchActuator, points: int = 121) -> CamCurves:
    """The curves of an actuator with an eccentric disc, from the closed to the open clutch, without friction.

    The torque is F l'(angle) by virtual work, the pressure angle arcsin(e sin(angle)/R) with the eccentricity e and the
    radius R of disc and roller together. Raises `ArgumentError` for an actuator without such a cam.
    """
    cam = getattr(model, "cam", None)
    if not hasattr(getattr(cam, "profile", None), "eccentricity"):
        raise ArgumentError(f"cam_curves takes an actuator with an eccentric disc, not {type(model).__name__}.")
    return _curves(model, jnp.linspace(0.0, STROKE, points))


def _curves(model: Any, strokes: Array) -> CamCurves:
    held = jax.vmap(lambda stroke: hold(model, stroke))(strokes)
    profile, ratio = model.cam.profile, model.gearbox.ratio
    angle = held.angle / ratio
    tilt = jnp.arcsin(profile.eccentricity * jnp.sin(angle) / profile.radius)
    return CamCurves(strokes, angle, jax.vmap(profile.lift)(angle), tilt, held.torque * ratio)
