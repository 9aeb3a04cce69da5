"""Actuators at rest: what holds them, and how they vibrate."""

import dataclasses
import functools as ft

import equinox as eqx
import jax
import numpy as np
import optimistix as optx
from jaxtyping import Float

from acausal import Scalar, linearise, replace
from components.electrical import ConstantCurrent
from components.rotational import LinearLift

from ._opening import opening
from .actuators import ClutchActuator, ElectromechanicalActuator, PumpActuator, WormActuator


@dataclasses.dataclass(frozen=True)
class Hold:
    """An actuator that stands still against its clutch spring."""

    stroke: Scalar  # m, of the slave
    pressure: Scalar  # Pa
    compression: Scalar  # m3, by which the liquid is compressed
    angle: Scalar  # rad, of the motor
    current: Scalar  # A


def hold(model: ClutchActuator, stroke: Scalar, near: Scalar | None = None) -> Hold:
    """The equilibrium at a stroke in m, by virtual work: the motor's k i per angle is the pressure times the volume.

    Friction and gear losses have no part in it. Where the cam's torque falls with its angle the equilibrium is
    unstable. `near` is an angle of the motor in rad from which that of the equilibrium is searched; without it, that of
    an opening run.
    """
    pressure = model.clutch.rate * stroke / model.slave.area
    compression = pressure / model.line.stiffness
    angle = _angle(model, stroke, compression, near)
    current = pressure * jax.grad(ft.partial(delivered, model))(angle) / model.motor.emf.k
    return Hold(stroke, pressure, compression, angle, current)


def mode_frequencies(model: ClutchActuator, stroke: Scalar, *, loaded: bool = False) -> Float[np.ndarray, " modes"]:
    """Frequencies in Hz of the undamped actuator, linearised at a stroke in m, in rising order.

    Undamped means without friction, and with a motor fed by a current, since the back-emf brakes one that is fed by a
    voltage. Without load the line is free of pressure at that stroke; `loaded` is the actuator held against its spring,
    where the pressure on the curved cam acts as a further stiffness.
    """
    undamped = eqx.tree_at(lambda m: (m.motor.bearing.C, m.line.damping, m.seal.C), model, (0.0, 0.0, 0.0))
    if loaded:
        rest = hold(model, stroke)
        undamped = _at_rest(_fed_by_current(undamped, rest.current), rest)
    else:
        undamped = _with_tangent_cam(_fed_by_current(undamped, 0.0), _angle(model, stroke, 0.0))
    frequencies = np.asarray(linearise(undamped).poles.imag) / (2.0 * np.pi)
    return frequencies[frequencies > 1e-6 * np.max(frequencies)]


def delivered(model: ClutchActuator, angle: Scalar) -> Scalar:
    """The volume in m3 that has left pump or master cylinder when the motor has turned by `angle` in rad."""
    if isinstance(model, PumpActuator):
        return model.pump.displacement * angle
    assert isinstance(model, ElectromechanicalActuator | WormActuator)
    return model.master.area * model.cam.profile.lift(angle / model.gearbox.ratio)


def _angle(model: ClutchActuator, stroke: Scalar, compression: Scalar, near: Scalar | None = None) -> Scalar:
    """The angle in rad of the motor at a stroke in m, the liquid being compressed by a volume in m3."""
    volume = model.slave.area * stroke + compression
    if isinstance(model, PumpActuator):
        return volume / model.pump.displacement
    # A cam passes the same lift twice a turn; an opening run tells which of the two is meant.
    near = opening(model, stroke=stroke).final.motor.shaft.phi if near is None else near
    solver = optx.Newton(rtol=1e-12, atol=1e-12)
    return optx.root_find(lambda angle, _: delivered(model, angle) / volume - 1.0, solver, near).value


def _fed_by_current(model: ClutchActuator, current: Scalar) -> ClutchActuator:
    """The model with a source of `current` in A in place of its supply."""
    return eqx.tree_at(lambda m: m.supply, model, ConstantCurrent(I=-current))


def _with_tangent_cam(model: ClutchActuator, angle: Scalar) -> ClutchActuator:
    """The cam replaced by a linear one of the slope that it has at an angle of the motor in rad."""
    if isinstance(model, PumpActuator):
        return model
    assert isinstance(model, ElectromechanicalActuator | WormActuator)
    slope = model.cam.profile.slope(angle / model.gearbox.ratio)
    return eqx.tree_at(lambda m: m.cam.profile, model, LinearLift(rate=slope))


def _at_rest(model: ClutchActuator, rest: Hold) -> ClutchActuator:
    """The model with start values at rest."""
    starts = {"slave.rod.s": rest.stroke, "line.V": rest.compression, "motor.shaft.phi": rest.angle}
    if not isinstance(model, PumpActuator):
        assert isinstance(model, ElectromechanicalActuator | WormActuator)
        starts["cam.shaft.phi"] = rest.angle / model.gearbox.ratio
    return replace(model, starts)
