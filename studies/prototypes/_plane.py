"""Opening times of the RE50 actuator over resistance and friction."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from acausal import Scalar

from .._measured import FULL, REDUCED
from ..actuators import ema_maxon, opening_time

RESISTANCES = np.linspace(0.08, 0.34, 27)  # ohm
FRICTIONS = np.linspace(1e-3, 14e-3, 27)  # N.m.s/rad


@eqx.filter_jit
def opening_times() -> dict[float, Float[jax.Array, "frictions resistances"]]:
    """Opening times in s by voltage; infinite if the clutch does not open within half a second."""

    def time(friction: Scalar, resistance: Scalar, voltage: Scalar) -> Scalar:
        model = ema_maxon(resistance=resistance, friction=friction, voltage=voltage)
        return opening_time(model, t_max=0.5, rtol=1e-6)

    grid = jax.vmap(jax.vmap(time, (None, 0, None)), (0, None, None))
    voltages = jnp.array([FULL, REDUCED])
    found: Any = jax.vmap(grid, (None, None, 0))(jnp.asarray(FRICTIONS), jnp.asarray(RESISTANCES), voltages)
    return {voltage: found[i] for i, voltage in enumerate((FULL, REDUCED))}
