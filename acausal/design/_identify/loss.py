"""Losses of a fit: the sum of squares, and convex losses that limit the influence of outliers."""

import math
from collections.abc import Sequence
from typing import Any, Literal, TypeAlias, get_args

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.integrate import quad
from scipy.optimize import root_scalar

from ..._errors import ParameterError
from ..._units.quantity import magnitude

LossName: TypeAlias = Literal["linear", "soft_l1", "huber"]
NAMES = get_args(LossName)


class Loss(eqx.Module):
    """The loss C^2 rho((r/C)^2) of a weighted residual r with the scale C, as in `scipy.optimize.least_squares`.

    - "linear": rho(z) = z, the square.
    - "soft_l1": rho(z) = 2 (sqrt(1 + z) - 1).
    - "huber": rho(z) = z for z <= 1, otherwise 2 sqrt(z) - 1.

    The search minimises the sum of squares of rescaled residuals, sign(r) C sqrt(rho), which is the sum of the losses.
    All functions except `rescaled` take the rescaled residuals. Source: Huber and Ronchetti, Robust Statistics, 2nd ed.
    """

    name: LossName = eqx.field(static=True)
    scale: Float[Array, ""]

    @classmethod
    def of(cls, name: LossName, scale: float) -> "Loss":
        """The loss with a name. Raises `ParameterError` for an unknown name and for a scale that is not positive."""
        if name not in NAMES:
            raise ParameterError(
                f"loss must be {', '.join(NAMES[:-1])} or {NAMES[-1]}, got {name!r}. Losses that are not convex, such "
                "as cauchy and arctan, are not offered: the estimates would depend on the start."
            )
        number = magnitude(scale, "1")
        if isinstance(number, bool) or not isinstance(number, int | float | np.floating) or not 0.0 < number < np.inf:
            raise ParameterError(f"f_scale must be a positive number of standard deviations of the noise, got {scale}.")
        return cls(name, jnp.asarray(float(number)))

    @property
    def is_robust(self) -> bool:
        """Whether the influence of a residual is bounded."""
        return self.name != "linear"

    def rescaled(self, r: Float[Array, " m"]) -> Float[Array, " m"]:
        """sign(r) C sqrt(rho((r/C)^2)) of weighted residuals."""
        if self.name == "soft_l1":
            return r * jnp.sqrt(2.0 / (1.0 + jnp.sqrt(1.0 + (r / self.scale) ** 2)))
        if self.name == "huber":
            outer = jnp.maximum(jnp.abs(r), self.scale)
            far = jnp.sign(r) * jnp.sqrt(self.scale * (2.0 * outer - self.scale))
            return jnp.where(jnp.abs(r) > self.scale, far, r)
        return r

    def weighted(self, q: np.ndarray) -> np.ndarray:
        """The weighted residuals r of rescaled ones."""
        c = float(self.scale)
        if self.name == "soft_l1":
            return q * np.sqrt(1.0 + (q / (2.0 * c)) ** 2)
        if self.name == "huber":
            return np.where(np.abs(q) > c, np.sign(q) * (q**2 + c**2) / (2.0 * c), q)
        return q

    def influence(self, q: np.ndarray) -> np.ndarray:
        """psi(r), half the derivative of the loss."""
        return self._psi(self.weighted(q))

    def _psi(self, r: Any) -> Any:
        c = float(self.scale)
        if self.name == "soft_l1":
            return r / np.sqrt(1.0 + (r / c) ** 2)
        return np.clip(r, -c, c) if self.name == "huber" else r

    def slope(self, q: np.ndarray) -> np.ndarray:
        """The derivative of rescaled residuals with respect to weighted ones, dq/dr = psi/q."""
        return np.where(q == 0.0, 1.0, self.influence(q) / np.where(q == 0.0, 1.0, q))

    def curvature(self, q: np.ndarray) -> np.ndarray:
        """The derivative of psi with respect to r."""
        r, c = self.weighted(q), float(self.scale)
        if self.name == "soft_l1":
            return (1.0 + (r / c) ** 2) ** -1.5
        return np.where(np.abs(r) <= c, 1.0, 0.0) if self.name == "huber" else np.ones_like(r)

    def noises(self, errors: Sequence[np.ndarray], freedoms: np.ndarray, least: np.ndarray) -> np.ndarray:
        """Standard deviations of the noise of channels: sum psi(error/sigma)^2 = freedom E[psi^2], Huber's proposal 2.

        E is the mean over the standard normal distribution. It is at least `least`, also for exact data.
        """
        mean = self._mean_square()
        most = np.sqrt([np.sum(e**2) / (mean * freedom) for e, freedom in zip(errors, freedoms, strict=True)])
        if self.is_robust:
            most = np.array(list(map(self._noise, errors, mean * freedoms, np.minimum(least, most), most)))
        return np.fmax(most, least)

    def _mean_square(self) -> float:
        if not self.is_robust:
            return 1.0

        def density(r: float) -> float:
            return float(self._psi(r)) ** 2 * math.exp(-0.5 * r * r)

        return math.sqrt(2.0 / math.pi) * quad(density, 0.0, np.inf)[0]

    def _noise(self, errors: np.ndarray, square: float, low: float, high: float) -> float:
        """The root in sigma of sum psi(error/sigma)^2 = square between `low` and `high`, or the end nearer to it."""

        def excess(sigma: float) -> float:
            return float(np.sum(self._psi(errors / sigma) ** 2)) - square

        if not excess(high) < 0.0 < excess(low):
            return high if excess(high) >= 0.0 else low
        return float(root_scalar(excess, bracket=(low, high), xtol=1e-12 * high, rtol=1e-12).root)
