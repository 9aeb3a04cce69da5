"""Joint distribution of parameters: their distributions, coupled by a Gaussian copula."""

import dataclasses
from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from ..._declare.component import Component
from ..._declare.node import leaves_of
from ..._errors import ModelError, ParameterError, suggestion
from .._problem.distributions import Distribution
from .._problem.free import Free, span_text
from .._problem.free_parameters import single_parameters
from .._problem.types import ByPath


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
