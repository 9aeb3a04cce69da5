"""Weighted least squares: residuals of experiments and priors as functions of scaled parameters, and their loss."""

import math
from collections.abc import Hashable, Sequence
from typing import Any, Literal, TypeAlias, get_args

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.integrate import quad
from scipy.optimize import root_scalar

from ..._declare.component import Component
from ..._errors import ParameterError
from ..._units.quantity import magnitude
from .._problem.free import Free
from .experiment import Prepared

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
        number = magnitude(scale, "1", "f_scale")
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


REFUSED = 1e10  # residual of a point that cannot be computed: the search rejects steps to it


class FitProblem(eqx.Module):
    """Residuals of experiments and priors as functions of the scaled free parameters z.

    Experiments of the same kind with equally many values are stacked and share one compiled run.
    """

    free: Free = eqx.field(static=True)
    shared: int = eqx.field(static=True)  # number of free parameters that all experiments share; they come first
    model: Component
    groups: tuple[Prepared, ...]
    loss: Loss
    prior_mean: Float[Array, " n"]
    prior_std: Float[Array, " n"]  # infinite without a prior

    def predicted(self, z: Float[Array, " n"]) -> list[dict[str, Array]]:
        """Predictions for each group, by name, with a leading axis of experiments."""
        x = self.free.unscaled(z)
        model = self.shared_model(x)
        return [_each(group, model, x) for group in self.groups]

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Bounds of the scaled parameters; infinite if there are none."""
        return jnp.asarray(self.free.scaled(self.free.low)), jnp.asarray(self.free.scaled(self.free.high))

    def shared_model(self, x: Array | np.ndarray) -> Component:
        """The model with the values of the shared free parameters."""
        return Free(self.free.variables[: self.shared]).with_values(self.model, x[: self.shared])

    def residuals(self, z: Float[Array, " n"]) -> Float[Array, " m"]:
        """(predicted - measured) / sigma of all experiments, rescaled by the loss, group by group; then of priors."""
        parts = [
            ((found[name] - group.measured[name]) / group.sigma[name]).ravel()
            for group, found in zip(self.groups, self.predicted(z), strict=True)
            for name in group.names
        ]
        rescaled = self.loss.rescaled(jnp.concatenate(parts))
        return jnp.concatenate([rescaled, (self.free.unscaled(z) - self.prior_mean) / self.prior_std])

    def residuals_and_jacobian(self, z: Float[Array, " n"]) -> tuple[Float[Array, " m"], Float[Array, "m n"]]:
        """Residuals and their derivatives by forward mode, from one run of each experiment."""

        def twice(z: Array) -> tuple[Array, Array]:
            residuals = self.residuals(z)
            return residuals, residuals

        jacobian, residuals = jax.jacfwd(twice, has_aux=True)(z)
        sound = jnp.all(jnp.isfinite(residuals)) & jnp.all(jnp.isfinite(jacobian))
        return jnp.where(sound, residuals, REFUSED), jnp.where(sound, jacobian, 0.0)

    def log_density(self, z: Float[Array, " n"]) -> Float[Array, ""]:
        """-chi2/2: the logarithm of the likelihood times the priors, up to a constant.

        Its gradient comes from the same forward run as its value, because parameters are few.
        """

        @jax.custom_jvp
        def value(z: Array) -> Array:
            residuals = self.residuals(z)
            return -0.5 * jnp.sum(jnp.where(jnp.all(jnp.isfinite(residuals)), residuals, REFUSED) ** 2)

        @value.defjvp
        def derivative(primals: tuple[Array], tangents: tuple[Array]) -> tuple[Array, Array]:
            residuals, jacobian = self.residuals_and_jacobian(primals[0])
            return -0.5 * jnp.sum(residuals**2), -(residuals @ jacobian) @ tangents[0]

        return value(z)


def _each(group: Prepared, model: Component, x: Array) -> dict[str, Array]:
    if group.measured[group.names[0]].shape[0] == 1:
        # A loop over one experiment would compile more slowly.
        single = jax.tree_util.tree_map(lambda leaf: leaf[0], group)
        return {name: value[None] for name, value in single.predicted(single.applied(model, x)).items()}
    # One by one: vectorised runs would wait for the slowest one.
    return jax.lax.map(lambda one: one.predicted(one.applied(model, x)), group)


def stacked(experiments: Sequence[Prepared]) -> tuple[tuple[Prepared, ...], list[tuple[int, int]]]:
    """Stacked groups of similar experiments, and the group and position of each experiment."""
    kinds: dict[Hashable, list[int]] = {}
    for i, experiment in enumerate(experiments):
        leaves, structure = jax.tree_util.tree_flatten(experiment)
        kinds.setdefault((structure, tuple(np.shape(leaf) for leaf in leaves)), []).append(i)
    groups, places = [], [(0, 0)] * len(experiments)
    for number, members in enumerate(kinds.values()):
        groups.append(jax.tree_util.tree_map(lambda *x: jnp.stack(x), *(experiments[i] for i in members)))
        for place, i in enumerate(members):
            places[i] = number, place
    return tuple(groups), places
