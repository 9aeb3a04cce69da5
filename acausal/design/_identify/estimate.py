"""Estimates of parameters with their covariance and intervals, and tests of their residuals against noise."""

import dataclasses
import functools as ft
from collections.abc import Callable
from typing import Any, Generic, NamedTuple, TypeVar

import jax
import numpy as np
from jaxtyping import Bool, Float
from scipy.stats import chi2, jarque_bera, shapiro, t

from ..._declare.component import Component
from ..._errors import UnknownNameError, suggestion
from .._problem.free import Free
from .entries import Channel, Combination, End
from .fit_problem import FitProblem, Loss
from .least_squares import Minimum, Multistart

M = TypeVar("M", bound=Component, covariant=True)
RANK = 1e-7  # relative size of singular values within the errors of the runs
WEAK = 1.0  # relative uncertainty above which a combination is indistinguishable


@dataclasses.dataclass(frozen=True, eq=False)
class Estimate(Generic[M]):
    """Estimates of parameters with their covariance. Arrays are in the order of `names`.

    `unexplained`: predictions that change with a parameter although their derivatives are zero, because they count or
    round. Its estimate, its interval and the rank then mean nothing.
    """

    _problem: FitProblem
    _free: Free
    _minimum: Minimum
    channels: tuple[Channel, ...]
    noise_freedom: float  # degrees of freedom of the noise; infinite for given noise
    level: float
    _tolerance: float
    _ends: Multistart | None = None
    unexplained: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the fitted parameters."""
        return self._free.names

    @property
    def units(self) -> tuple[str, ...]:
        """The declared units of the fitted parameters."""
        return self._free.units

    @property
    def evaluations(self) -> int:
        """Number of evaluations of all experiments with derivatives."""
        return self._minimum.evaluations

    @ft.cached_property
    def estimates(self) -> Float[np.ndarray, " n"]:
        """The estimated values in the declared units."""
        return np.asarray(self._free.unscaled(self._minimum.z))

    @property
    def model(self) -> M:
        """The model with the estimates of the shared parameters."""
        return self._problem.shared_model(self.estimates)  # pyright: ignore[reportReturnType]

    def model_of(self, experiment: str) -> M:
        """The model in an experiment, with its changes and all estimates."""
        places = {channel.experiment: (channel.group, channel.place) for channel in self.channels}
        if experiment not in places:
            raise UnknownNameError(f"The fit has no experiment {experiment!r}.{suggestion(experiment, places)}")
        group, place = places[experiment]
        own = jax.tree_util.tree_map(lambda leaf: leaf[place], self._problem.groups[group])
        return own.applied(self.model, self.estimates)

    @property
    def ends(self) -> tuple[End, ...]:
        """Ends of the searches from several starts, the best first, with the first guess of estimated noise."""
        if self._ends is None:
            return ()
        rows = zip(*(self._free.unscaled(z) for z in self._ends[:2]), self._ends.chi2.tolist(), strict=True)
        return tuple(sorted((End(np.asarray(x), np.asarray(y), chi2) for x, y, chi2 in rows), key=lambda end: end.chi2))

    @property
    def at_bound(self) -> Bool[np.ndarray, " n"]:
        """Marks parameters that the data push against their bound."""
        return self._minimum.at_bound

    @property
    def loss(self) -> Loss:
        """The loss of a weighted residual."""
        return self._problem.loss

    @property
    def chi2(self) -> float:
        """The sum of the losses of the weighted residuals, by default their squares, including priors."""
        return self._minimum.chi2

    @property
    def dof(self) -> int:
        """Degrees of freedom: values and priors minus parameters within their bounds."""
        priors = int(np.sum(np.isfinite(self._problem.prior_std)))
        return sum(channel.n_values for channel in self.channels) + priors - int(np.sum(~self.at_bound))

    @ft.cached_property
    def jacobian(self) -> Float[np.ndarray, "m n"]:
        """Derivatives of the weighted residuals with respect to the parameters in their units."""
        rescaled = self._of_values(self.loss.slope)
        return self._minimum.jacobian / rescaled[:, None] / np.asarray(self._free.slopes(self.estimates))

    def _of_values(self, function: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """A function of the rescaled residuals of measured values, then 1 for each prior, which keeps the square."""
        values, priors = np.split(self._minimum.residuals, [-len(self.names)])
        return np.concatenate([function(values), np.ones(len(priors))])

    @ft.cached_property
    def _relative(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Reference sizes of the parameters, and the SVD of the derivatives with respect to relative changes."""
        sizes = np.where(self.estimates != 0.0, np.abs(self.estimates), np.asarray(self._free.slopes(self.estimates)))
        sizes = np.where(self.at_bound, 0.0, sizes)
        weights = np.sqrt(self._of_values(self.loss.curvature))
        left, values, right = np.linalg.svd(weights[:, None] * self.jacobian * sizes, full_matrices=False)
        return sizes, left, values, right

    @property
    def singular_values(self) -> Float[np.ndarray, " n"]:
        """Singular values of the derivatives of weighted residuals with respect to relative changes of parameters.

        The rows are multiplied by the square root of the curvature of the loss, which is 1 for squares.
        """
        return self._relative[2]

    @property
    def rank(self) -> int:
        """Rank of the Fisher information, excluding parameters at a bound."""
        values = self.singular_values
        return int(np.sum(values > RANK * np.max(values, initial=0.0)))

    @ft.cached_property
    def covariance(self) -> Float[np.ndarray, "n n"]:
        """(J^T J)^-1, or the sandwich of `identify`.

        It is infinite for undetermined parameters and zero for those at a bound.
        """
        sizes, _, values, right = self._relative
        right = right[: self.rank] / values[: self.rank, None]
        covariance = sizes[:, None] * (right.T @ self._scatter(right) @ right) * sizes
        lost = self._undetermined
        covariance[lost, lost] = np.inf
        return covariance

    def _scatter(self, right: np.ndarray) -> np.ndarray:
        """Scatter of the gradient of the losses along scaled principal directions: the identity for squares."""
        if not self.loss.is_robust:
            return np.eye(len(right))
        scores = (self._of_values(self.loss.influence)[:, None] * self.jacobian * self._relative[0]) @ right.T
        n = self.dof + int(np.sum(~self.at_bound))
        return scores.T @ scores * np.divide(n, self.dof)

    @property
    def _undetermined(self) -> Bool[np.ndarray, " n"]:
        """Marks parameters in an undetermined direction."""
        return ~self.at_bound & np.any(np.abs(self._relative[3][self.rank :]) > 1e-4, axis=0)

    @property
    def std(self) -> Float[np.ndarray, " n"]:
        """Standard deviations of the estimates; nan at a bound."""
        return np.where(self.at_bound, np.nan, np.sqrt(np.diag(self.covariance)))

    @property
    def std_scaled_by_residual(self) -> Float[np.ndarray, " n"]:
        """Standard deviations if the given noise is known up to one factor, which is estimated from the residuals."""
        if self.loss.is_robust:
            return self.std  # the sandwich contains the scatter of the residuals
        return self.std * np.sqrt(self.chi2 / self.dof) if self.dof > 0 else np.full(len(self.names), np.nan)

    @property
    def correlation(self) -> Float[np.ndarray, "n n"]:
        """Correlation of the estimates; nan for undetermined parameters and those at a bound."""
        std = np.where(np.isfinite(self.std), self.std, np.nan)
        return self.covariance / np.outer(std, std)

    @property
    def _quantile(self) -> float:
        freedom = self.dof if self.loss.is_robust else self.noise_freedom
        return float(t.ppf(0.5 + 0.5 * self.level, freedom))

    @property
    def low(self) -> Float[np.ndarray, " n"]:
        """Lower ends of the confidence intervals, within the bounds."""
        return np.fmax(self.estimates - self._quantile * self.std, self._free.low)

    @property
    def high(self) -> Float[np.ndarray, " n"]:
        """Upper ends of the confidence intervals, within the bounds."""
        return np.fmin(self.estimates + self._quantile * self.std, self._free.high)

    @property
    def combinations(self) -> tuple[Combination, ...]:
        """Principal directions of the parameters, the least determined one first."""
        sizes, _, values, right = self._relative
        known = right[: self.rank] / values[: self.rank, None]
        stds = np.sqrt(np.diag(self._scatter(known))) / values[: self.rank]
        found = []
        for i in range(len(right) - 1, -1, -1):
            if np.any(sizes[np.abs(right[i]) > 1e-8]):
                sign = 1.0 if right[i][np.argmax(np.abs(right[i]))] > 0.0 else -1.0
                std = stds[i] if i < self.rank else np.inf
                found.append(Combination(dict(zip(self.names, (sign * right[i]).tolist(), strict=True)), float(std)))
        return tuple(found)

    @property
    def indistinguishable(self) -> tuple[Combination, ...]:
        """Combinations with a relative uncertainty above one."""
        return tuple(combination for combination in self.combinations if combination.std > WEAK)

    @property
    def residuals(self) -> dict[str, Float[np.ndarray, " n"]]:
        """(predicted - measured) / sigma by experiment and channel; NaN for missing values."""
        found = self._minimum.residuals
        return {
            c.label: np.where(np.isnan(c.measured), np.nan, self.loss.weighted(found[c.rows])) for c in self.channels
        }

    @property
    def sigma(self) -> dict[str, Float[np.ndarray, " n"]]:
        """Standard deviations of the noise, given or estimated."""
        return {channel.label: self._sigma(channel) for channel in self.channels}

    @property
    def predicted(self) -> dict[str, Float[np.ndarray, " n"]]:
        """Predictions of the fitted model."""
        return {c.label: c.measured + self.residuals[c.label] * self._sigma(c) for c in self.channels}

    def _sigma(self, channel: Channel) -> np.ndarray:
        return np.ravel(self._problem.groups[channel.group].sigma[channel.name][channel.place])


LEAST = 8  # fewest values for a test of normality or whiteness
MOST = 5000  # most values for the test of Shapiro and Wilk
DOUBT = 0.01  # probability below which a test rejects the model or the noise


class ResidualTest(NamedTuple):
    """A test of residuals. `probability`: that noise alone gives such a value or a more extreme one."""

    name: str  # "size", "normality" or "whiteness"
    about: str
    statistic: float
    probability: float

    @property
    def passed(self) -> bool:
        """Whether the residuals can be noise."""
        return self.probability >= DOUBT

    def __str__(self) -> str:
        said = "" if self.passed else ": unlikely to be noise"
        return f"{self.name} of residuals, {self.about}: {self.statistic:.4g}, probability {self.probability:.3g}{said}"


def tests_of(fit: Estimate[Any]) -> tuple[ResidualTest, ...]:
    """Tests of normality and whiteness by channel, and of the size of all residuals if squares with given noise are
    fitted.
    """
    has_size = not fit.loss.is_robust and not any(channel.is_estimated for channel in fit.channels)
    found = [_size(fit)] if has_size else []
    for channel in fit.channels:
        residuals = fit.residuals[channel.label]
        residuals = residuals[np.isfinite(residuals)]
        if len(residuals) >= LEAST and np.ptp(residuals) > 0.0:
            found.append(_normality(residuals, channel.label))
            if channel.times is not None:
                found.append(_whiteness(residuals, channel.label))
    return tuple(found)


def _size(fit: Estimate[Any]) -> ResidualTest:
    """Two-sided chi2 test, for residuals that are too large or too small for the noise."""
    low, high = chi2.cdf(fit.chi2, fit.dof), chi2.sf(fit.chi2, fit.dof)
    about = f"chi2 with {fit.dof} degrees of freedom"
    return ResidualTest("size", about, fit.chi2, float(min(1.0, 2 * min(low, high))))


def _normality(residuals: Float[np.ndarray, " n"], label: str) -> ResidualTest:
    """Shapiro and Wilk (1965), or Jarque and Bera (1980) for more than `MOST` values."""
    outcome: Any = shapiro(residuals) if len(residuals) <= MOST else jarque_bera(residuals)
    return ResidualTest("normality", label, float(outcome.statistic), float(outcome.pvalue))


def _whiteness(residuals: Float[np.ndarray, " n"], label: str) -> ResidualTest:
    """Ljung and Box (1978): Q = n (n + 2) sum r_k^2/(n - k) over the autocorrelations r_k, chi2-distributed."""
    n = len(residuals)
    lags = min(10, n // 4)
    centred = residuals - np.mean(residuals)
    correlations = [centred[k:] @ centred[:-k] / (centred @ centred) for k in range(1, lags + 1)]
    q = n * (n + 2) * sum(r * r / (n - k) for k, r in enumerate(correlations, start=1))
    return ResidualTest("whiteness", label, float(q), float(chi2.sf(q, lags)))
