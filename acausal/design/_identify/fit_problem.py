"""Weighted least squares: residuals of experiments and priors as functions of scaled parameters."""

from collections.abc import Hashable, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._declare.component import Component
from .._problem.free import Free
from .experiment import Prepared
from .loss import Loss

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
