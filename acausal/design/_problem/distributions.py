"""Distributions of parameters: prior knowledge or scatter in production."""

import abc
import dataclasses
import warnings
from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from jaxtyping import Float
from scipy.special import ndtr, ndtri
from scipy.stats import qmc

from ..._errors import ParameterError
from ..._units.display import Scale
from ..._units.quantity import has_unit, magnitude
from .free import span_text
from .types import difference_in, number_in


@dataclasses.dataclass(frozen=True)
class Normal:
    """The normal distribution. `mean` defaults to the value in the model; `std` can be a share of the mean: "5 %".

    Values are numbers in the declared unit, quantities, or texts such as "0.2 mm".
    """

    mean: Any = None
    std: Any = None

    @property
    def is_relative(self) -> bool:
        """Whether the scatter is relative to the value in the model."""
        return _percent(self.std) is not None

    def resolved(self, unit: str, where: str, nominal: float) -> "Normal":
        """A copy with numbers in the declared unit."""
        if self.std is None:
            raise ParameterError(f"{where}: Normal needs a standard deviation, as in Normal(std='5 %').")
        mean = nominal if self.mean is None else number_in(self.mean, unit, where)[0]
        std = _difference(self.std, unit, where, mean)
        if not (np.isfinite(mean) and np.isfinite(std) and std > 0.0):
            raise ParameterError(f"{where}: a standard deviation must be positive and finite, got {self.std}.")
        return Normal(mean, std)

    def of_score(self, z: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Values from standard normal scores."""
        return self.mean + self.std * z

    def box(self, sigmas: float) -> tuple[float, float]:
        """Tolerance band of so many standard deviations to either side."""
        return self.mean - sigmas * self.std, self.mean + sigmas * self.std


class Bounded(abc.ABC):
    """A bounded distribution, defined by its quantile function."""

    @property
    def is_relative(self) -> bool:
        """Whether the scatter is relative to the value in the model."""
        return any(_percent(value) is not None for value in vars(self).values())

    @abc.abstractmethod
    def quantile(self, u: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Values of the quantile function."""

    def box(self, sigmas: float) -> tuple[float, float]:
        """Tolerance band: the bounds."""
        del sigmas
        low, high = self.quantile(np.array([0.0, 1.0])).tolist()
        return low, high

    def of_score(self, z: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Values from standard normal scores."""
        return self.quantile(ndtr(z))


@dataclasses.dataclass(frozen=True)
class Uniform(Bounded):
    """The uniform distribution. A bound "-5 %" or "+5 %" is relative to the value in the model."""

    low: Any
    high: Any

    def resolved(self, unit: str, where: str, nominal: float) -> "Uniform":
        """A copy with numbers in the declared unit."""
        low, high = (_limit(value, unit, where, nominal) for value in (self.low, self.high))
        _check_order(where, low, high, unit)
        return Uniform(low, high)

    @property
    def mean(self) -> float:
        """The mean in the declared unit."""
        return 0.5 * (self.low + self.high)

    @property
    def std(self) -> float:
        """The standard deviation in the declared unit."""
        return (self.high - self.low) / np.sqrt(12.0)

    def quantile(self, u: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Values of the quantile function at probabilities from 0 to 1, in the declared unit."""
        return (1.0 - u) * self.low + u * self.high


@dataclasses.dataclass(frozen=True)
class Triangular(Bounded):
    """The triangular distribution. `mode` defaults to the value in the model.

    A bound "-5 %" or "+5 %" is relative to the value in the model.
    """

    low: Any
    high: Any
    mode: Any = None

    def resolved(self, unit: str, where: str, nominal: float) -> "Triangular":
        """A copy with numbers in the declared unit."""
        low, high = (_limit(value, unit, where, nominal) for value in (self.low, self.high))
        mode = nominal if self.mode is None else _limit(self.mode, unit, where, nominal)
        _check_order(where, low, high, unit)
        if not low <= mode <= high:
            scale = Scale.of(unit)
            raise ParameterError(
                f"{where}: the mode {scale.value(mode):g}{scale.text} is outside the bounds "
                f"{span_text(low, high, scale)}."
            )
        return Triangular(low, high, mode)

    @property
    def mean(self) -> float:
        """The mean in the declared unit."""
        return (self.low + self.mode + self.high) / 3.0

    @property
    def std(self) -> float:
        """The standard deviation in the declared unit."""
        a, b, c = self.low, self.high, self.mode
        return float(np.sqrt((a * a + b * b + c * c - a * b - a * c - b * c) / 18.0))

    def quantile(self, u: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Values of the quantile function at probabilities from 0 to 1, in the declared unit."""
        width, rise = self.high - self.low, self.mode - self.low
        below = self.low + np.sqrt(u * width * rise)
        above = self.high - np.sqrt((1.0 - u) * width * (width - rise))
        return np.where(u * width < rise, below, above)


@dataclasses.dataclass(frozen=True, eq=False)
class Samples(Bounded):
    """The empirical distribution of measured values, interpolated linearly."""

    values: Any

    def resolved(self, unit: str, where: str, nominal: float) -> "Samples":
        """A copy with sorted numbers in the declared unit."""
        del nominal
        given: Any = magnitude(self.values, unit, where) if has_unit(self.values) else self.values
        if isinstance(given, Sequence):
            given = [number_in(value, unit, where)[0] for value in given]
        values = np.sort(np.ravel(np.asarray(given, float)))
        if len(values) < 2 or not np.all(np.isfinite(values)) or values[0] == values[-1]:
            raise ParameterError(f"{where}: Samples needs at least two different finite values, got {self.values!r}.")
        return Samples(values)

    @property
    def mean(self) -> float:
        """The mean in the declared unit."""
        return float(np.mean(self.values))

    @property
    def std(self) -> float:
        """The standard deviation in the declared unit."""
        return float(np.std(self.values, ddof=1))

    def quantile(self, u: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Values of the quantile function at probabilities from 0 to 1, in the declared unit."""
        n = len(self.values)
        return np.interp(u, (np.arange(n) + 0.5) / n, self.values)


Distribution: TypeAlias = Normal | Uniform | Triangular | Samples


def _percent(value: object) -> float | None:
    """The share in a text such as "5 %"; None for anything else."""
    if isinstance(value, str) and value.rstrip().endswith("%"):
        try:
            return float(value.rstrip()[:-1]) / 100.0
        except ValueError:
            return None
    return None


def _difference(value: object, unit: str, where: str, mean: float) -> float:
    share = _percent(value)
    return difference_in(value, unit, where) if share is None else share * abs(mean)


def _limit(value: object, unit: str, where: str, nominal: float) -> float:
    share = _percent(value)
    return number_in(value, unit, where)[0] if share is None else nominal + share * abs(nominal)


def _check_order(where: str, low: float, high: float, unit: str) -> None:
    if not (np.isfinite(low) and np.isfinite(high) and low < high):
        span = span_text(low, high, Scale.of(unit))
        raise ParameterError(f"{where}: the lower bound must be below the upper one, got {span}.")


def member_count(n: int) -> int:
    """The number of members. Raises `ParameterError` unless it is an integer of at least 2."""
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 2:
        raise ParameterError(f"The number of members must be an integer of at least 2, got {n!r}.")
    return int(n)


def sobol_scores(dimensions: int, n: int, seed: int) -> Float[np.ndarray, "n k"]:
    """Standard normal scores of `n` members of a scrambled Sobol sequence."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about n that is not a power of two
        points = qmc.Sobol(dimensions, rng=np.random.default_rng(seed)).random(n)
    return ndtri(np.clip(points, 1e-12, 1.0 - 1e-12))
