"""Distributions of parameters: what is known of a number beforehand, or how it scatters in production."""

import abc
import dataclasses
import warnings
from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from jaxtyping import Float

from ..._errors import ParameterError
from ..._units.display import Scale
from ..._units.quantity import has_unit, magnitude
from .free import span_text
from .parse import difference_in, number_in


@dataclasses.dataclass(frozen=True)
class Normal:
    """The normal distribution; `mean` is the model's own value unless given, and `std` may be a share of it: "5 %".

    Numbers are in the declared unit, quantities, or texts such as "0.2 mm".
    """

    mean: Any = None
    std: Any = None

    @property
    def is_relative(self) -> bool:
        """Whether it scatters by a share of the model's own value."""
        return _percent(self.std) is not None

    def resolved(self, unit: str, where: str, nominal: float) -> "Normal":
        """The same with numbers in the declared unit."""
        if self.std is None:
            raise ParameterError(f"{where}: Normal needs a standard deviation, as in Normal(std='5 %').")
        mean = nominal if self.mean is None else number_in(self.mean, unit, where)[0]
        std = _difference(self.std, unit, where, mean)
        if not (np.isfinite(mean) and np.isfinite(std) and std > 0.0):
            raise ParameterError(f"{where}: a standard deviation must be positive and finite, got {self.std}.")
        return Normal(mean, std)

    def of_score(self, z: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Values from scores of the standard normal distribution."""
        return self.mean + self.std * z

    def box(self, sigmas: float) -> tuple[float, float]:
        """The tolerance: so many standard deviations to either side."""
        return self.mean - sigmas * self.std, self.mean + sigmas * self.std


class Bounded(abc.ABC):
    """A distribution that is known by its quantiles."""

    @property
    def is_relative(self) -> bool:
        """Whether it scatters by a share of the model's own value."""
        return any(_percent(value) is not None for value in vars(self).values())

    @abc.abstractmethod
    def quantile(self, u: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """The values below which the shares `u` lie."""

    def of_score(self, z: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Values from scores of the standard normal distribution."""
        from scipy.special import ndtr

        return self.quantile(ndtr(z))


@dataclasses.dataclass(frozen=True)
class Uniform(Bounded):
    """All values between two limits equally likely. A limit "-5 %" or "+5 %" is that far from the model's own value."""

    low: Any
    high: Any

    def resolved(self, unit: str, where: str, nominal: float) -> "Uniform":
        """The same with numbers in the declared unit."""
        low, high = (_limit(value, unit, where, nominal) for value in (self.low, self.high))
        _check_order(where, low, high, unit)
        return Uniform(low, high)

    @property
    def mean(self) -> float:
        return 0.5 * (self.low + self.high)

    @property
    def std(self) -> float:
        return (self.high - self.low) / np.sqrt(12.0)

    def quantile(self, u: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """The values below which the shares `u` lie."""
        return self.low + (self.high - self.low) * u

    def box(self, sigmas: float) -> tuple[float, float]:
        """The limits."""
        del sigmas
        return self.low, self.high


@dataclasses.dataclass(frozen=True)
class Triangular(Bounded):
    """Values between two limits, the most likely one at `mode`, by default the model's own value.

    A limit "-5 %" or "+5 %" is that far from the model's own value.
    """

    low: Any
    high: Any
    mode: Any = None

    def resolved(self, unit: str, where: str, nominal: float) -> "Triangular":
        """The same with numbers in the declared unit."""
        low, high = (_limit(value, unit, where, nominal) for value in (self.low, self.high))
        mode = nominal if self.mode is None else _limit(self.mode, unit, where, nominal)
        _check_order(where, low, high, unit)
        if not low <= mode <= high:
            scale = Scale.of(unit)
            raise ParameterError(
                f"{where}: the mode {scale.value(mode):g}{scale.text} lies outside of the limits "
                f"{span_text(low, high, scale)}."
            )
        return Triangular(low, high, mode)

    @property
    def mean(self) -> float:
        return (self.low + self.mode + self.high) / 3.0

    @property
    def std(self) -> float:
        a, b, c = self.low, self.high, self.mode
        return float(np.sqrt((a * a + b * b + c * c - a * b - a * c - b * c) / 18.0))

    def quantile(self, u: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """The values below which the shares `u` lie."""
        width, rise = self.high - self.low, self.mode - self.low
        below = self.low + np.sqrt(u * width * rise)
        above = self.high - np.sqrt((1.0 - u) * width * (width - rise))
        return np.where(u * width < rise, below, above)

    def box(self, sigmas: float) -> tuple[float, float]:
        """The limits."""
        del sigmas
        return self.low, self.high


@dataclasses.dataclass(frozen=True, eq=False)
class Samples(Bounded):
    """The values of a table, such as those measured on parts, each equally likely, and linear between them."""

    values: Any

    def resolved(self, unit: str, where: str, nominal: float) -> "Samples":
        """The same with numbers in the declared unit, in rising order."""
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
        return float(np.mean(self.values))

    @property
    def std(self) -> float:
        return float(np.std(self.values, ddof=1))

    def quantile(self, u: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """The values below which the shares `u` lie; the outermost ones are the limits."""
        n = len(self.values)
        return np.interp(u, (np.arange(n) + 0.5) / n, self.values)

    def box(self, sigmas: float) -> tuple[float, float]:
        """The smallest and the largest value."""
        del sigmas
        return float(self.values[0]), float(self.values[-1])


Distribution: TypeAlias = Normal | Uniform | Triangular | Samples


def _percent(value: object) -> float | None:
    """The share that a text such as "5 %" stands for."""
    if isinstance(value, str) and value.rstrip().endswith("%"):
        try:
            return float(value.rstrip()[:-1]) / 100.0
        except ValueError:
            return None
    return None


def _difference(value: object, unit: str, where: str, mean: float) -> float:
    share = _percent(value)
    if share is not None:
        return share * abs(mean)
    return difference_in(value, unit, where)


def _limit(value: object, unit: str, where: str, nominal: float) -> float:
    share = _percent(value)
    return number_in(value, unit, where)[0] if share is None else nominal + share * abs(nominal)


def _check_order(where: str, low: float, high: float, unit: str) -> None:
    if not (np.isfinite(low) and np.isfinite(high) and low < high):
        span = span_text(low, high, Scale.of(unit))
        raise ParameterError(f"{where}: the lower limit must be below the upper one, got {span}.")


def member_count(n: int) -> int:
    """The number of members, checked; raises `ParameterError` unless it is an integer of at least 2."""
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 2:
        raise ParameterError(f"The number of members is an integer of at least 2, got {n!r}.")
    return int(n)


def sobol_scores(dimensions: int, n: int, seed: int) -> Float[np.ndarray, "n k"]:
    """Scores of `n` members of a scrambled Sobol sequence, which fills the space evenly."""
    from scipy.special import ndtri
    from scipy.stats import qmc

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that n is no power of two
        points = qmc.Sobol(dimensions, rng=np.random.default_rng(seed)).random(n)
    return ndtri(np.clip(points, 1e-12, 1.0 - 1e-12))
