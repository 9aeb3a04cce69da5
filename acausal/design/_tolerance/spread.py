"""The distribution of a result: moments, percentiles, yield and causes of the variance."""

import dataclasses
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from jaxtyping import Float
from scipy.special import ndtr, ndtri

from ..._analyse.table import aligned
from ..._errors import ModelError, ParameterError
from ..._extras import Axes
from ..._report import Table, drawn, report
from ..._units.display import Scale
from ..._units.quantity import has_unit
from .._problem.parse import number_in

SHOWN = (1.0, 5.0, 50.0, 95.0, 99.0)  # percentiles in tables


@dataclasses.dataclass(frozen=True)
class Cause:
    """Contribution of a parameter to the variance of a result, to first order.

    `std`: standard deviation of the parameter in its declared unit. `change`: change of the result for one standard
    deviation. `share`: share of the variance, possibly negative for correlated parameters. Shares sum to one.
    """

    parameter: str
    scale: Scale
    std: float
    change: float
    share: float


def _cause_rows(result: str, scale: Scale, causes: Sequence[Cause]) -> list[list[str]]:
    """Table of causes, the largest share first, below its heads."""
    rows = [
        [
            cause.parameter,
            f"{cause.share:.4f}",
            f"{scale.difference(cause.change):.4g}",
            f"{cause.scale.difference(cause.std):.4g}",
            cause.scale.unit,
        ]
        for cause in sorted(causes, key=lambda cause: -abs(cause.share))
    ]
    return [[f"variance of {result}", "share", scale.headed("change"), "for std", "unit"], *rows]


@dataclasses.dataclass(frozen=True, eq=False)
class Spread:
    """The distribution of a result, in SI units or in the unit that the function returns; `print` it for a table.

    - `method`: "first order", "second order", "Monte Carlo" or "Sobol sequence".
    - `std_error`: of the mean, for independent samples.
    - `samples`: computed values of the result, or values of the second-order polynomial.
    - `failed`: number of failed members by reason. Mean and percentiles exclude them.
    - `causes`: contributions of parameters to the variance, for the first-order method.
    - `unfinished`: number of members missing after an interrupt.
    - `unexplained`: parameters that change the result otherwise than its derivatives explain, because it counts, rounds
      or jumps. Methods by derivatives then miss their contribution.
    """

    result: str
    scale: Scale
    method: str
    mean: float
    std: float
    samples: Float[np.ndarray, " n"]
    failed: Mapping[str, int] = dataclasses.field(default_factory=dict)
    std_error: float = 0.0
    causes: tuple[Cause, ...] = ()
    unfinished: int = 0
    unexplained: tuple[str, ...] = ()

    @property
    def shares(self) -> dict[str, float]:
        """Shares of the variance by parameter, for the first-order method."""
        return {cause.parameter: cause.share for cause in self.causes}

    def percentile(self, p: npt.ArrayLike) -> Any:
        """The p-th percentile, or several for a sequence."""
        if not np.all((np.asarray(p) >= 0.0) & (np.asarray(p) <= 100.0)):
            raise ParameterError(f"A percentile must be between 0 and 100, got {p}.")
        if self.method == "first order":
            found = self.mean + self.std * ndtri(np.asarray(p, float) / 100.0)
        else:
            found = np.percentile(self.samples, np.asarray(p, float))
        return float(found) if np.ndim(found) == 0 else found

    def share(self, low: Any = None, high: Any = None) -> "Yield":
        """The share of members between two limits, with its 95 % interval by Wilson. Failed members are outside."""
        if low is None and high is None:
            raise ModelError("A yield needs a limit: share(low=...), share(high=...) or both.")
        below = -np.inf if low is None else self._limit(low)
        above = np.inf if high is None else self._limit(high)
        n = len(self.samples) + sum(self.failed.values())
        if self.method == "first order":
            inside = float(ndtr((above - self.mean) / self.std) - ndtr((below - self.mean) / self.std))
            return Yield(inside, inside, inside)
        inside = float(np.sum((self.samples >= below) & (self.samples <= above))) / n
        return Yield(inside, *(_wilson(inside, n) if self.failed or self.std_error else (inside, inside)))

    def _limit(self, limit: Any) -> float:
        """A limit in the unit of the result, from a number in this unit, a text or a quantity."""
        if not isinstance(limit, str) and not has_unit(limit):
            return float(limit)
        return float(self.scale.zero + self.scale.factor * number_in(limit, self.scale.unit, self.result)[0])

    def plot(self, ax: Axes | None = None, limits: Any = ()) -> Axes:
        """Draws a histogram, the normal distribution, percentiles and `limits` in SI units; returns the axes."""
        from .spread_plots import plot_spread

        return plot_spread(self, ax, limits)

    def row(self) -> list[str]:
        """Its line in a table."""
        numbers = [self.mean, *self.percentile(SHOWN)]
        mean, *percentiles = (f"{self.scale.value(number):.5g}" for number in numbers)
        std = f"{self.scale.difference(self.std):.4g}"
        return [self.result, self.scale.unit, self.method, mean, std, *percentiles, str(sum(self.failed.values()))]

    def __str__(self) -> str:
        return table([self])


@dataclasses.dataclass(frozen=True)
class Yield:
    """The share of members within a specification, with its confidence interval."""

    share: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{100 * self.share:.4g} % ({100 * self.low:.4g} to {100 * self.high:.4g} %)"


class Spreads(dict[str, Spread]):
    """Distributions of several results by name; `print` it for a table."""

    def __str__(self) -> str:
        return table(list(self.values()))

    def html(self, path: str | os.PathLike[str] | None = None) -> str:
        """A report as one HTML file that loads nothing from elsewhere; returns its text, and writes it to a path.

        It has the distribution of each result with its picture, failures, and the causes of the variance. `report`
        combines several results.
        """
        return report(f"Tolerances of {', '.join(self)}", self._report(), path)

    def _report(self) -> dict[str, object]:
        spreads = list(self.values())
        pictures = [drawn(spread.plot) for spread in spreads if spread.std > 0.0]
        causes = [_cause_rows(s.result, s.scale, s.causes) for s in spreads if s.causes]
        notes = "\n".join(_remarks(spreads))
        found: dict[str, object] = {"Distributions": [Table(_HEAD, [s.row() for s in spreads]), notes, *pictures]}
        return found | ({"Causes": [Table(rows[0], rows[1:]) for rows in causes]} if causes else {})


_HEAD = ["result", "unit", "method", "mean", "std", *(f"{p:g} %" for p in SHOWN), "failed"]


def table(spreads: list[Spread]) -> str:
    """Table of distributions, failures and causes of the variance."""
    lines = [aligned([_HEAD, *(spread.row() for spread in spreads)]), *_remarks(spreads)]
    return "\n".join([*lines, *(aligned(_cause_rows(s.result, s.scale, s.causes)) for s in spreads if s.causes)])


def _remarks(spreads: list[Spread]) -> list[str]:
    """Reasons of failures, and members that an interrupt left out."""
    failed = next((spread.failed for spread in spreads if spread.failed), {})
    lines = [f"failed, {number} times: {reason}" for reason, number in failed.items()]
    if unfinished := max(spread.unfinished for spread in spreads):
        lines.append(f"interrupted: {unfinished} members are missing")
    return lines + [sentence for spread in spreads for sentence in spread.unexplained]


def _wilson(share: float, n: int) -> tuple[float, float]:
    """95 % interval of a binomial share (Wilson, 1927)."""
    z = 1.959963984540054
    centre = (share + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * np.sqrt(share * (1 - share) / n + z * z / (4 * n * n))
    return float(max(centre - half, 0.0)), float(min(centre + half, 1.0))
