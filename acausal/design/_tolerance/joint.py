"""Joint distribution of parameters: their distributions, coupled by a Gaussian copula."""

import dataclasses
from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float, PyTree

from ..._declare.component import Component
from ..._declare.node import leaves_of
from ..._errors import ModelError, ParameterError, suggestion
from ..._integrate.setup.result import is_success
from .._compute.evaluator import Evaluator
from .._problem.distributions import Distribution, member_count, sobol_scores
from .._problem.free import Free, span_text
from .._problem.free_parameters import single_parameters
from .._problem.types import ByPath, Function


@dataclasses.dataclass(frozen=True)
class JointDistribution:
    """Distributions of parameters with the Cholesky factor `root` of the correlation of their normal scores."""

    free: Free
    marginals: tuple[Distribution, ...]
    root: Float[np.ndarray, "k k"]

    @staticmethod
    def of(
        model: Component, distributions: ByPath[Distribution], correlation: Mapping[tuple[str, str], float] | None
    ) -> "JointDistribution":
        """From distributions by path. Raises `ModelError` or `ParameterError` for invalid ones."""
        free = single_parameters(model, distributions, "A distribution is that of one number: name elements of arrays")
        return JointDistribution(free, _resolved(free, distributions, model), _root(free.names, correlation or {}))

    @property
    def means(self) -> Float[np.ndarray, " k"]:
        return np.array([marginal.mean for marginal in self.marginals])

    @property
    def std(self) -> Float[np.ndarray, " k"]:
        return np.array([marginal.std for marginal in self.marginals])

    @property
    def covariance(self) -> Float[np.ndarray, "k k"]:
        """From standard deviations and the correlation of the scores; exact if all parameters are normal."""
        return self.std[:, None] * (self.root @ self.root.T) * self.std

    def parameters_at(self, scores: Float[np.ndarray, "n k"]) -> Float[np.ndarray, "n k"]:
        """Parameters from independent standard normal scores."""
        mixed = np.asarray(scores) @ self.root.T
        return np.stack([m.of_score(column) for m, column in zip(self.marginals, mixed.T, strict=True)], axis=1)

    def box(self, model: Component, sigmas: float) -> Float[np.ndarray, "k 2"]:
        """Tolerance band of each parameter. Raises `ParameterError` for a band outside the declared range."""
        box = np.array([marginal.box(sigmas) for marginal in self.marginals])
        declarations = {leaf.path: leaf.declaration for leaf in leaves_of(model)}
        for variable, ends in zip(self.free.variables, box, strict=True):
            for declaration in (declarations[place.path] for place in variable.places if place.built is None):
                if not np.all(declaration.admits(ends)):
                    raise ParameterError(
                        f"{variable.name} must be {declaration.range}, but the worst case goes from "
                        f"{span_text(ends[0], ends[1], variable.scale)}. Use fewer "
                        "`sigmas`, or a distribution within the range."
                    )
        return box


def _resolved(free: Free, distributions: ByPath[Distribution], model: Component) -> tuple[Distribution, ...]:
    """The distributions with numbers in declared units."""
    found = []
    values = zip(free.variables, distributions.values(), free.values(model).tolist(), strict=True)
    for variable, distribution, nominal in values:
        if not isinstance(distribution, Distribution):
            raise ModelError(
                f"{variable.name}: give a distribution, such as Normal(std='5 %') or Uniform(1.0, 2.0); "
                f"got {distribution!r}."
            )
        found.append(distribution.resolved(variable.unit, variable.name, nominal))
    return tuple(found)


def _root(names: tuple[str, ...], correlation: Mapping[tuple[str, str], float]) -> np.ndarray:
    """The Cholesky factor of the correlation matrix of the scores."""
    matrix = np.eye(len(names))
    for pair, value in correlation.items():
        if not isinstance(pair, tuple) or len(pair) != 2 or pair[0] == pair[1]:
            raise ModelError(
                f"correlation must have pairs of different parameters as keys, as in {{('a', 'b'): 0.5}}; got {pair!r}."
            )
        unknown = [name for name in pair if name not in names]
        if unknown:
            raise ModelError(f"{unknown[0]!r} has a correlation but no distribution.{suggestion(unknown[0], names)}")
        i, j = (names.index(name) for name in pair)
        matrix[i, j] = matrix[j, i] = value
    try:
        return np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError as error:
        raise ParameterError("The correlations contradict one another: they are not positive definite.") from error


def percentile_of(
    model: Component,
    distributions: ByPath[Distribution],
    result: Function,
    p: float,
    *,
    run: Function | None = None,
    correlation: Mapping[tuple[str, str], float] | None = None,
    n: int = 64,
    seed: int = 0,
) -> Function:
    """The p-th percentile of a result among `n` members around a design, as a function of the design.

        slow = percentile_of(drive, {"motor.resistor.R": Normal(std="5 %")}, lambda s: s.t1, 95.0, run=...)
        optimise(drive, {"gear.ratio": (2.0, 20.0)}, (slow, "ms"))

    All designs share the members of a Sobol sequence, so the percentile has an exact gradient and is smooth, except for
    kinks where the order of members changes. A relative tolerance scales with the value in the design, an absolute one
    does not. The other arguments are those of `Tolerance`.
    """
    if not 0.0 <= p <= 100.0:
        raise ParameterError(f"A percentile must be between 0 and 100, got {p}.")
    joint = JointDistribution.of(model, distributions, correlation)
    free, x0 = joint.free, joint.free.values(model)
    for place in (variable.places[0] for variable in free.variables):
        if place.built is not None:
            names = ", ".join(sorted(place.determined))
            raise ModelError(f"percentile_of: {place.path} is a constructor argument. Name instead: {names}.")
    members = joint.parameters_at(sobol_scores(len(x0), member_count(n), seed))
    is_share = np.array([distribution.is_relative for distribution in distributions.values()])
    factors = np.where(is_share, members / np.where(is_share & (x0 != 0.0), x0, 1.0), 1.0)
    offsets = np.where(is_share, 0.0, members - x0)
    evaluator = Evaluator(model, free, {"result": result}, run)

    def percentile(design: PyTree) -> Array:
        leaves = {leaf.path: leaf.value for leaf in leaves_of(design)}
        places = [variable.places[0] for variable in free.variables]
        base = jnp.stack([leaves[path] if at is None else leaves[path][at] for path, at, _ in places])

        def one(pair: PyTree) -> Array:
            values, outcomes = evaluator.results(free.with_values(design, base * pair[0] + pair[1]))
            is_good = jnp.all(jnp.stack([jnp.ones((), bool), *map(is_success, outcomes)]))
            return jnp.where(is_good, values, jnp.nan)

        values = jax.lax.map(one, (jnp.asarray(factors), jnp.asarray(offsets)))
        return jnp.percentile(values, p)

    return percentile
