"""The ratios that the thesis chose for its gearboxes, found from the model."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy

from acausal import Scalar

from ..actuators import LONGEST, ClutchActuator, ElectromechanicalActuator, delivered, opening_time, spring_rate

RANGE = (1.5, 8.0)  # of the ratios among which the best is sought


def least_ratio(model: ElectromechanicalActuator, torque: float, stroke: float) -> float:
    """The ratio below which a motor with a torque in N.m would stop before the stroke in m, inertia left out.

    The volume V that has left the master cylinder moves the slave and is compressed, so that the spring of rate k
    gives the pressure V / (A^2 / k + 1 / stiffness); the torque at the motor is p dV/dangle.
    """

    def at(angle: Scalar) -> tuple[Scalar, Scalar]:
        volume, slope = jax.value_and_grad(lambda angle: delivered(model, angle))(angle)
        pressure = volume / (model.slave.area**2 / spring_rate(model) + 1.0 / model.line.stiffness)
        return pressure * slope, pressure * model.slave.area / spring_rate(model)

    half_turn = np.pi * model.gearbox.ratio
    torques, strokes = jax.vmap(at)(half_turn * jnp.linspace(0.0, 1.0, 20001))
    return float(np.max(np.where(strokes <= stroke, torques, 0.0)) * model.gearbox.ratio / torque)


def best_ratio(design: Callable[..., ClutchActuator], rtol: float) -> float:
    """The ratio of a design with which the clutch opens first."""

    @eqx.filter_jit
    def time(ratio: Scalar) -> Scalar:
        return opening_time(design(ratio=ratio), rtol=rtol)

    # A ratio with which the clutch does not open at all counts as slow.
    found = scipy.optimize.minimize_scalar(
        lambda ratio: min(float(time(jnp.asarray(ratio))), LONGEST), bounds=RANGE, method="bounded"
    )
    return float(found.x)
