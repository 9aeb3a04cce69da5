"""The gearbox ratios of the thesis, computed with the model."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy

from acausal import Scalar

from ..actuators import LONGEST, ClutchActuator, ElectromechanicalActuator, delivered, opening_time, spring_rate

RANGE = (1.5, 8.0)  # search range of the best ratio


def least_ratio(model: ElectromechanicalActuator, torque: float, stroke: float) -> float:
    """The smallest ratio with which a motor torque in N.m reaches the stroke in m, without inertia.

    The volume V from the master cylinder moves the slave and compresses the liquid. With the spring rate k, the
    pressure is p = V / (A^2 / k + 1 / stiffness), and the torque at the motor is p dV/dangle.
    """

    def at(angle: Scalar) -> tuple[Scalar, Scalar]:
        volume, slope = jax.value_and_grad(lambda angle: delivered(model, angle))(angle)
        pressure = volume / (model.slave.area**2 / spring_rate(model) + 1.0 / model.line.stiffness)
        return pressure * slope, pressure * model.slave.area / spring_rate(model)

    half_turn = np.pi * model.gearbox.ratio
    torques, strokes = jax.vmap(at)(half_turn * jnp.linspace(0.0, 1.0, 20001))
    return float(np.max(np.where(strokes <= stroke, torques, 0.0)) * model.gearbox.ratio / torque)


def best_ratio(design: Callable[..., ClutchActuator], rtol: float) -> float:
    """The ratio of minimum opening time."""

    @eqx.filter_jit
    def time(ratio: Scalar) -> Scalar:
        return opening_time(design(ratio=ratio), rtol=rtol)

    # A ratio with which the clutch does not open gets a large time.
    found = scipy.optimize.minimize_scalar(
        lambda ratio: min(float(time(jnp.asarray(ratio))), LONGEST), bounds=RANGE, method="bounded"
    )
    return float(found.x)
