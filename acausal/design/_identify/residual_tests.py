"""Tests of residuals against noise: size, normality and whiteness."""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.stats import chi2, jarque_bera, shapiro

from .estimate import Estimate

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
