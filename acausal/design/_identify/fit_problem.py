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

REFUSED = 1e10  # residual of a trial that cannot be computed: no step leads there


class FitProblem(eqx.Module):
    """Residuals of experiments and priors, as functions of the scaled free parameters z.

    Experiments of the same kind, with as many values, are stacked and share the program of one run.
    """

    free: Free = eqx.field(static=True)
    shared: int = eqx.field(static=True)  # how many of the free parameters, the first ones, all experiments share
    model: Component
    groups: tuple[Prepared, ...]
    prior_mean: Float[Array, " n"]
    prior_std: Float[Array, " n"]  # infinite where there is none

    def predicted(self, z: Float[Array, " n"]) -> list[dict[str, Array]]:
        """What the model predicts for each group, by name, with an axis of experiments in front."""
        x = self.free.unscaled(z)
        model = self.shared_model(x)
        return [_each(group, model, x) for group in self.groups]

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Of the scaled parameters; infinite where there are none."""
        return jnp.asarray(self.free.scaled(self.free.low)), jnp.asarray(self.free.scaled(self.free.high))

    def shared_model(self, x: Array | np.ndarray) -> Component:
        """The model with the values of what is free in all experiments."""
        return Free(self.free.variables[: self.shared]).with_values(self.model, x[: self.shared])

    def residuals(self, z: Float[Array, " n"]) -> Float[Array, " m"]:
        """(predicted - measured) / sigma of all experiments, group by group, then those of the priors."""
        parts = [
            ((found[name] - group.measured[name]) / group.sigma[name]).ravel()
            for group, found in zip(self.groups, self.predicted(z), strict=True)
            for name in group.names
        ]
        return jnp.concatenate([*parts, (self.free.unscaled(z) - self.prior_mean) / self.prior_std])

    def residuals_and_jacobian(self, z: Float[Array, " n"]) -> tuple[Float[Array, " m"], Float[Array, "m n"]]:
        """Residuals and their derivatives by forward mode, from one run of each experiment."""

        def twice(z: Array) -> tuple[Array, Array]:
            residuals = self.residuals(z)
            return residuals, residuals

        jacobian, residuals = jax.jacfwd(twice, has_aux=True)(z)
        sound = jnp.all(jnp.isfinite(residuals)) & jnp.all(jnp.isfinite(jacobian))
        return jnp.where(sound, residuals, REFUSED), jnp.where(sound, jacobian, 0.0)


def _each(group: Prepared, model: Component, x: Array) -> dict[str, Array]:
    if group.measured[group.names[0]].shape[0] == 1:
        # A loop over one costs more to compile than the experiment by itself.
        single = jax.tree_util.tree_map(lambda leaf: leaf[0], group)
        return {name: value[None] for name, value in single.predicted(single.applied(model, x)).items()}
    # One by one: runs that are stepped together wait for the slowest one.
    return jax.lax.map(lambda one: one.predicted(one.applied(model, x)), group)


def stacked(experiments: Sequence[Prepared]) -> tuple[tuple[Prepared, ...], list[tuple[int, int]]]:
    """Experiments of the same kind as one, and for each experiment its group and its place in it."""
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
