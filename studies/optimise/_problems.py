"""The optimisation problems, each with one parameter."""

import dataclasses
import functools as ft
import math
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from acausal import Scalar
from acausal.design import Scale

from .._measured import measured
from ..actuators import ClutchActuator, ehs_maxon, ema_fise, ema_maxon, opening_time
from ._minimise import Point, minimise

CM3_PER_REV = 1e-6 / (2.0 * math.pi)  # m3/rad


@dataclasses.dataclass(frozen=True)
class Problem:
    """The opening time of an actuator as a function of one of its parameters."""

    actuator: str
    build: Callable[..., ClutchActuator]
    parameter: str
    unit: str
    start: float
    low: float  # of the sweep
    high: float
    built: float  # in the thesis' prototype
    measured: float  # opening time in s of the prototype, measured in the thesis

    @property
    def scale(self) -> Scale:
        """The display unit of the parameter."""
        return Scale.of(self.unit)

    def model(self, value: Scalar) -> ClutchActuator:
        return self.build(**{self.parameter: value})

    def evaluate(self, value: float, rtol: float = 1e-9) -> tuple[float, float]:
        """Opening time in s and its derivative with respect to the parameter."""
        model, direction = jax.jvp(self.model, (jnp.asarray(value, float),), (jnp.ones(()),))
        time, slope = time_and_slope(model, direction, rtol)
        return float(time), float(slope)

    def solve(self, rtol: float = 1e-9) -> list[Point]:
        """The path of the optimiser from the start to the optimum."""
        return minimise(ft.partial(self.evaluate, rtol=rtol), self.start)

    def sweep(self, points: int = 64, rtol: float = 1e-9) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
        """Logarithmically spaced values of the parameter, and the opening times; one run under `vmap`."""
        values = np.geomspace(self.low, self.high, points)
        return values, np.asarray(_times(jax.vmap(self.model)(jnp.asarray(values)), rtol))


@jax.jit
def time_and_slope(model: ClutchActuator, direction: ClutchActuator, rtol: Scalar) -> tuple[Scalar, Scalar]:
    return jax.jvp(lambda model: opening_time(model, rtol=rtol), (model,), (direction,))


@jax.jit
def _times(models: Any, rtol: Scalar) -> Any:
    return jax.vmap(lambda model: opening_time(model, rtol=rtol))(models)


def _measured(actuator: str) -> float:
    """Measured opening time in s of the prototype at full voltage."""
    found = measured(actuator, "opening time")
    assert found is not None
    return found


# Start values: the ratio of the thesis, twice the ratio, and half the displacement.
PROBLEMS = (
    Problem("ema_fise", ema_fise, "ratio", "1", 12.0, 3.6, 16.0, 12.0, _measured("ema_fise")),
    Problem("ema_maxon", ema_maxon, "ratio", "1", 8.6, 1.6, 10.0, 4.3, _measured("ema_maxon")),
    Problem(
        "ehs_maxon", ehs_maxon, "displacement", "m3/rad", 0.625 * CM3_PER_REV, 0.5 * CM3_PER_REV, 2.6 * CM3_PER_REV,
        1.25 * CM3_PER_REV, _measured("ehs_maxon"),
    ),
)  # fmt: skip
