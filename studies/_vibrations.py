"""Natural frequencies of actuators at rest."""

import equinox as eqx
import numpy as np
from jaxtyping import Float

from acausal import Scalar, linearise
from components.electrical import ConstantCurrent
from components.rotational import LinearLift

from .actuators import ClutchActuator, ElectromechanicalActuator, PumpActuator, WormActuator, angle_at, at_rest, hold


def mode_frequencies(model: ClutchActuator, stroke: Scalar, *, loaded: bool = False) -> Float[np.ndarray, " modes"]:
    """Natural frequencies in Hz of the undamped actuator, linearised at a stroke in m, in ascending order.

    The undamped actuator has no friction, and a current source feeds its motor, because with a voltage source the
    back-emf brakes the motor. Without load, the line pressure is zero at that stroke. With `loaded`, the actuator is
    held against its spring, and the pressure on the curved cam adds stiffness.
    """
    undamped = eqx.tree_at(lambda m: (m.motor.bearing.C, m.line.damping, m.seal.C), model, (0.0, 0.0, 0.0))
    if loaded:
        rest = hold(model, stroke)
        undamped = at_rest(_fed_by_current(undamped, rest.torque / model.motor.emf.k), rest)
    else:
        undamped = _with_tangent_cam(_fed_by_current(undamped, 0.0), angle_at(model, model.slave.area * stroke))
    frequencies = np.asarray(linearise(undamped).poles.imag) / (2.0 * np.pi)
    return frequencies[frequencies > 1e-6 * np.max(frequencies)]


def _fed_by_current(model: ClutchActuator, current: Scalar) -> ClutchActuator:
    """The model with a source of `current` in A in place of its supply."""
    return eqx.tree_at(lambda m: m.supply, model, ConstantCurrent(I=-current))


def _with_tangent_cam(model: ClutchActuator, angle: Scalar) -> ClutchActuator:
    """The model with a linear cam that has the slope of the cam at a motor angle in rad."""
    if isinstance(model, PumpActuator):
        return model
    assert isinstance(model, ElectromechanicalActuator | WormActuator)
    slope = model.cam.profile.slope(angle / model.gearbox.ratio)
    return eqx.tree_at(lambda m: m.cam.profile, model, LinearLift(rate=slope))
