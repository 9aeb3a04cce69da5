"""Statics of the open clutch, without friction and gear losses: the hold, and the requirements on a cam."""

import dataclasses
import functools as ft
from typing import Any, TypeVar

import jax
import jax.numpy as jnp

from acausal import Scalar, replace
from components.rotational import EccentricDisc, LinearLift

from ._models import ClutchActuator, ElectromechanicalActuator, PumpActuator, WormActuator
from ._opening import STROKE
from ._parameters import SUPPLY

M = TypeVar("M", bound=ClutchActuator)
WORN = 1.08 * STROKE  # m, stroke of the slave with a worn clutch
RESERVE = 1.01  # reserve factor of the cam lift


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True)
class Hold:
    """Static equilibrium of an actuator against its clutch spring."""

    stroke: Scalar  # m, of the slave
    pressure: Scalar  # Pa
    compression: Scalar  # m3, compression of the liquid
    angle: Scalar  # rad, of the motor
    torque: Scalar  # N.m, load at the motor shaft, without friction
    current: Scalar  # A, of the motor
    power: Scalar  # W, into the motor

    def battery_current(self, voltage: Scalar = SUPPLY) -> Scalar:
        """The battery current in A at a battery voltage in V, with a lossless converter."""
        return self.power / voltage


def hold(model: ClutchActuator, stroke: Scalar = STROKE) -> Hold:
    """The equilibrium at a stroke in m, by virtual work: the motor torque is the pressure times dvolume/dangle.

    At rest, the motor takes the power R i^2. The present actuator is held by its worm, without current (section 6.1 of
    the thesis). The equilibrium is unstable if the torque of the cam decreases with its angle.
    """
    pressure = line_pressure(model, stroke)
    compression = pressure / model.line.stiffness
    angle = angle_at(model, model.slave.area * stroke + compression)
    torque = pressure * jax.grad(ft.partial(delivered, model))(angle)
    current = jnp.zeros(()) if isinstance(model, WormActuator) else torque / model.motor.emf.k
    return Hold(stroke, pressure, compression, angle, torque, current, model.motor.resistor.R * current**2)


def at_rest(model: M, rest: Hold) -> M:
    """The model with start values of the static equilibrium."""
    starts = {"slave.rod.s": rest.stroke, "line.V": rest.compression, "motor.shaft.phi": rest.angle}
    if not isinstance(model, PumpActuator):
        assert isinstance(model, ElectromechanicalActuator | WormActuator)
        starts["cam.shaft.phi"] = rest.angle / model.gearbox.ratio
    return replace(model, starts)


def line_pressure(model: ClutchActuator, stroke: Scalar = STROKE) -> Scalar:
    """The line pressure in Pa with the slave at a stroke in m."""
    return model.clutch.force(stroke) / model.slave.area


def delivered(model: ClutchActuator, angle: Scalar) -> Scalar:
    """The volume in m3 that the pump or master cylinder displaces over the motor angle `angle` in rad."""
    if isinstance(model, PumpActuator):
        return model.pump.displacement * angle
    assert isinstance(model, ElectromechanicalActuator | WormActuator)
    return model.master.area * model.cam.profile.lift(angle / model.gearbox.ratio)


def angle_at(model: ClutchActuator, volume: Scalar) -> Scalar:
    """The motor angle in rad for a volume in m3 displaced by the pump or master cylinder; inverse of `delivered`."""
    if isinstance(model, PumpActuator):
        return volume / model.pump.displacement
    assert isinstance(model, ElectromechanicalActuator | WormActuator)
    profile, lift = model.cam.profile, volume / model.master.area
    if isinstance(profile, LinearLift):
        return model.gearbox.ratio * lift / profile.rate
    # In the first half of its turn, lift = -e cos(angle) + sqrt(radius^2 - (e sin(angle))^2) - (radius - e).
    assert isinstance(profile, EccentricDisc)
    e, radius = profile.eccentricity, profile.radius
    reach = lift + radius - e
    return model.gearbox.ratio * jnp.arccos((radius**2 - e**2 - reach**2) / (2.0 * reach * e))


def holding_current(model: ClutchActuator) -> Scalar:
    """The motor current in A with the clutch open."""
    return hold(model).current


def lift_share(model: Any, stroke: Scalar) -> Scalar:
    """The required lift for a stroke in m, relative to the lift of the cam."""
    rest = hold(model, stroke)
    lift = (model.slave.area * stroke + rest.compression) / model.master.area
    return RESERVE * lift / (2.0 * model.cam.profile.eccentricity)


def pressure_angle(model: Any) -> Scalar:
    """The largest pressure angle of the cam, in rad."""
    return jnp.arcsin(model.cam.profile.eccentricity / model.cam.profile.radius)
