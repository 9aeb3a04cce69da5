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
from ..._errors import ModelError, ParameterError, SimulationError
from ..._extras import Axes, given_or_new
from ..._report import Table, drawn, report
from ..._units.display import Scale
from ..._units.quantity import has_unit
from .._problem.types import number_in
from .._sweep.batches import Outcomes

REPLICATES = 200  # bootstrap samples


@dataclasses.dataclass(frozen=True, eq=False)
class Indices:
    """Sobol' indices of results (rows) and parameters (columns); `print` it for a table.

    `first`: share of the variance that a parameter causes alone. `total`: share including all interactions with others.
    `first_error` and `total_error`: standard errors by bootstrap. `lost`: number of samples with a failed run.
    `unfinished`: number of samples missing after an interrupt.
    """

    parameters: tuple[str, ...]
    results: tuple[str, ...]
    first: Float[np.ndarray, "m k"]
    total: Float[np.ndarray, "m k"]
    first_error: Float[np.ndarray, "m k"]
    total_error: Float[np.ndarray, "m k"]
    lost: int
    unfinished: int = 0

    def plot(self, ax: Axes | None = None, result: str = "") -> Axes:
        """Draws bars of both indices of one result with their errors; returns the matplotlib axes."""

        return plot_indices(self, ax, result)

    def __str__(self) -> str:
        lines = []
        for row, result in enumerate(self.results):
            cells = [
                [self.parameters[i], *(f"{v[row, i]:.4f}" for v in (self.first, self.first_error)),
                 *(f"{v[row, i]:.4f}" for v in (self.total, self.total_error))]
                for i in np.argsort(-self.total[row])
            ]  # fmt: skip
            lines.append(aligned([[f"variance of {result}", "alone", "±", "in total", "±"], *cells]))
        lines += [f"{self.lost} samples lost to failed runs"] if self.lost else []
        lines += [f"interrupted: {self.unfinished} samples are missing"] if self.unfinished else []
        return "\n".join(lines)


def indices_of(
    parameters: tuple[str, ...], results: tuple[str, ...], outcomes: Outcomes, n: int, k: int, seed: int
) -> Indices:
    """Indices from n samples: each has a row of A, of B, and of A with one column of B after the other."""
    values = np.swapaxes(outcomes.values.reshape(n, k + 2, -1), 0, 1)
    good = np.all(outcomes.are_good.reshape(n, k + 2), axis=1)
    unfinished = int(np.sum(np.any(~outcomes.are_finished.reshape(n, k + 2), axis=1)))
    if np.sum(good) < 2:
        raise SimulationError(f"Only {np.sum(good)} of {n} samples could be computed: {outcomes.failed}.")
    values = values[:, good]
    rng, count = np.random.default_rng(seed), values.shape[1]
    estimates = _estimated(values)
    again = [_estimated(values[:, rng.integers(0, count, count)]) for _ in range(REPLICATES)]
    errors = [np.std([pair[i] for pair in again], axis=0, ddof=1) for i in range(2)]
    return Indices(
        parameters, results, estimates[0], estimates[1], errors[0], errors[1], int(n - count) - unfinished, unfinished
    )


def _estimated(values: Float[np.ndarray, "q n m"]) -> tuple[np.ndarray, np.ndarray]:
    """First-order indices by Saltelli (2010) and total ones by Jansen (1999)."""
    a, b, mixed = values[0], values[1], values[2:]
    variance = np.var(np.concatenate([a, b]), axis=0)
    safe = np.where(variance > 0.0, variance, 1.0)
    # Subtracting the mean reduces rounding errors and the scatter of the first estimator.
    first = np.mean((b - np.mean(b, axis=0)) * (mixed - a), axis=1) / safe
    total = 0.5 * np.mean((mixed - a) ** 2, axis=1) / safe
    return first.T, total.T


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


def plot_spread(spread: Spread, ax: Axes | None, limits: Any) -> Axes:
    """A histogram beside the normal distribution of the same mean and standard deviation, with `limits`."""
    ax = given_or_new(ax, 6.5, 3.6)
    mean, std = spread.scale.value(spread.mean), spread.scale.difference(spread.std)
    if len(spread.samples):
        bins = int(np.clip(np.sqrt(len(spread.samples)), 10, 60))
        ax.hist(spread.scale.value(spread.samples), bins=bins, density=True, color="tab:blue", alpha=0.45)
    x = np.linspace(mean - 4.0 * std, mean + 4.0 * std, 200)
    normal = np.exp(-0.5 * ((x - mean) / std) ** 2) / (std * np.sqrt(2.0 * np.pi))
    ax.plot(x, normal, color="0.3", linewidth=1.0, label="normal")
    for p, label in ((1.0, "1 % and 99 %"), (99.0, "")):
        ax.axvline(spread.scale.value(spread.percentile(p)), color="tab:blue", linewidth=1.0, ls="--", label=label)
    for number, limit in enumerate(np.ravel(limits)):
        ax.axvline(spread.scale.value(limit), color="tab:red", linewidth=1.5, label="" if number else "limit")
    ax.set_xlabel(spread.scale.headed(spread.result))
    ax.set_ylabel(f"density per{spread.scale.text}" if spread.scale.text else "density")
    ax.legend(frameon=False, fontsize="small")
    lost = f", {sum(spread.failed.values())} failed" if spread.failed else ""
    ax.set_title(f"{spread.method}: {mean:.5g} ± {std:.3g}{spread.scale.text}{lost}", fontsize="medium")
    return ax


def plot_indices(indices: Indices, ax: Axes | None, result: str) -> Axes:
    """Bars of both indices of one result with their errors, the largest on top."""
    row = indices.results.index(result) if result else 0
    order = np.argsort(indices.total[row])
    ax = given_or_new(ax, 7.0, 1.4 + 0.45 * len(order))
    places = np.arange(len(order))
    for shift, values, errors, label, colour in (
        (0.2, indices.total, indices.total_error, "in total", "tab:blue"),
        (-0.2, indices.first, indices.first_error, "alone", "tab:orange"),
    ):
        bars = values[row, order]
        ax.barh(places + shift, bars, 0.38, xerr=2.0 * errors[row, order], label=label, color=colour, ecolor="0.3")
    ax.set_yticks(places, [indices.parameters[i] for i in order])
    ax.set_xlabel(f"share of the variance of {indices.results[row]}")
    ax.legend(frameon=False, fontsize="small", loc="lower right")
    ax.grid(axis="x", alpha=0.3)
    return ax
