"""Result of a fit to measurements: estimates, intervals, residual tests and profile likelihoods, with pictures."""

import dataclasses
import os
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float
from scipy.optimize import root_scalar
from scipy.special import ndtri
from scipy.stats import t

from ..._analyse.table import aligned
from ..._errors import ArgumentError, ModelError, ParameterError, SimulationError, UnknownNameError, suggestion
from ..._extras import Axes, Panels, given_or_new, panels
from ..._report import Table, drawn, model_parts, report
from ..._units.display import Scale
from .._problem.free_parameters import why_not_built
from .entries import Channel
from .estimate import Estimate, M, ResidualTest, tests_of
from .least_squares import minimise

TRIES = 40  # most fits in the search for one end of the interval


@dataclasses.dataclass(frozen=True)
class Profile:
    """chi2 over the values of a parameter, with the others fitted; `low` and `high` are the interval at `level`.

    If chi2 does not reach the threshold, an end is the bound of the parameter, infinite without one.
    """

    name: str
    unit: str
    scale: Scale
    level: float
    values: Float[np.ndarray, " n"]
    chi2: Float[np.ndarray, " n"]
    threshold: float
    low: float
    high: float

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws chi2 over the parameter with the threshold and the interval; returns the matplotlib axes."""

        return plot_profile(self, ax)

    def __str__(self) -> str:
        low, high = (f"{self.scale.value(end):.6g}" for end in (self.low, self.high))
        return f"{self.name} from {low} to {high}{self.scale.text} at {100 * self.level:g} %, by its profile"


def profile(fit: Estimate[Any], index: int, points: int, level: float) -> Profile:
    """Profile from the estimate to either side until chi2 reaches the threshold."""
    if not 0.0 < level < 1.0:
        raise ParameterError(f"level must be between 0 and 1, got {level}.")
    if fit.loss.is_robust:
        raise ModelError(
            f"There is no profile likelihood with the loss {fit.loss.name}, because the rise of its sum is not "
            "distributed as chi2. Use the interval of the covariance, fit.low to fit.high."
        )
    rise = float(t.ppf(0.5 + 0.5 * level, fit.noise_freedom)) ** 2
    sides = [_side(fit, index, direction, rise, points) for direction in (-1.0, 1.0)]
    values = np.concatenate([sides[0][0][::-1], [fit.estimates[index]], sides[1][0]])
    chi2 = np.concatenate([sides[0][1][::-1], [fit.chi2], sides[1][1]])
    name, unit, scale = fit.names[index], fit.units[index], fit._free.variables[index].scale
    return Profile(name, unit, scale, level, values, chi2, fit.chi2 + rise, sides[0][2], sides[1][2])


def _side(
    fit: Estimate[Any], index: int, direction: float, rise: float, points: int
) -> tuple[np.ndarray, np.ndarray, float]:
    """Values and chi2 on one side, and the value at which chi2 has risen by `rise`."""
    held = np.arange(len(fit.names)) == index
    z0, found = fit._minimum.z, {0.0: (fit._minimum.z, 0.0)}
    limit = float(np.asarray(fit._free.scaled(fit._free.low if direction < 0 else fit._free.high))[index])
    farthest = abs(limit - z0[index])
    if farthest == 0.0:
        return np.zeros(0), np.zeros(0), float(fit.estimates[index])

    def risen(distance: float) -> float:
        """Rise of chi2 above its minimum; the other parameters start from the nearest known fit."""
        if distance not in found:
            near = min(found, key=lambda known: abs(known - distance))
            start = found[near][0].copy()
            start[index] = z0[index] + direction * distance
            minimum = minimise(fit._problem, start, held, fit._tolerance)
            above = minimum.chi2 - fit.chi2 if minimum.computed else np.inf
            found[distance] = (minimum.z if minimum.computed else start, above)
        return found[distance][1]

    end = _crossing(risen, _first_guess(fit, index, rise, farthest), farthest, rise)
    outermost = end if end is not None else min(farthest, max(found))
    shown = np.linspace(0.0, outermost, points + 1)[1:].tolist()
    chi2 = np.array([fit.chi2 + risen(distance) for distance in shown])

    def value(distance: float) -> float:
        moved = z0.copy()
        moved[index] += direction * distance
        return float(np.asarray(fit._free.unscaled(moved))[index])

    bound = float((fit._free.low if direction < 0 else fit._free.high)[index])
    return np.array([value(distance) for distance in shown]), chi2, bound if end is None else value(end)


def _first_guess(fit: Estimate[Any], index: int, rise: float, farthest: float) -> float:
    """Scaled distance at which chi2 has risen by `rise`, according to the covariance."""
    slope = float(np.asarray(fit._free.slopes(fit.estimates))[index])
    guess = float(np.sqrt(rise) * fit.std[index] / slope)
    return min(guess, farthest) if np.isfinite(guess) and guess > 0.0 else min(0.1, 0.5 * farthest)


def _crossing(risen: Any, guess: float, farthest: float, rise: float) -> float | None:
    """Distance at which chi2 has risen by `rise`; None if it does not rise so far."""
    low, high = 0.0, guess
    for _ in range(TRIES):
        if risen(high) >= rise:
            # A point that cannot be computed is outside.
            found = root_scalar(lambda d: min(risen(d), 1e6 * rise) - rise, bracket=(low, high), rtol=1e-7)
            return float(found.root)
        if high >= farthest or high > 1e6 * guess:
            return None
        low, high = high, min(2.0 * high, farthest)
    raise SimulationError("The profile found no end of the interval. Narrow the bounds of the parameter.")


SAME = 1e-3  # relative difference of equal sums of squares; absolute below 1


@dataclasses.dataclass(frozen=True, eq=False)
class Fit(Estimate[M]):
    """The result of `identify`; `print` it for a table. Arrays are in the order of `names`."""

    @property
    def tests(self) -> tuple[ResidualTest, ...]:
        """Tests of the residuals against noise."""
        return tests_of(self)

    def profile(self, name: str, *, points: int = 9, level: float | None = None) -> Profile:
        """Profile likelihood of a parameter: chi2 over its values, with all others fitted again.

        Its interval is also correct for strongly nonlinear models, unlike that from the covariance. The profile has
        `points` values on either side, up to the ends of the interval at `level`.

        Raises `ModelError` for a fit with a robust loss.
        """
        if name not in self.names:
            raise UnknownNameError(f"The fit has no parameter {name!r}.{suggestion(name, self.names)}")
        return profile(self, self.names.index(name), points, self.level if level is None else level)

    def log_density(self, x: Any) -> Array:
        """The logarithm of the likelihood times the priors at parameters in their units, up to a constant: -chi2/2.

        With a robust loss, the likelihood is that of the noise whose density is exp(-loss/2).

        `x` is in the order of `names`. The density is zero, and its logarithm -inf, outside the bounds. jax can
        compile and differentiate it, so that it is the argument of samplers: its gradient costs a run with forward
        derivatives. Estimated noise counts as known. A run that fails gives a density of practically zero.

        Raises `ArgumentError` unless `x` has one number for each parameter.
        """
        x = jnp.asarray(x, float)
        if x.shape != (len(self.names),):
            raise ArgumentError(
                f"log_density takes a vector of {len(self.names)} numbers ({', '.join(self.names)}), got the shape "
                f"{x.shape}. For several points, use jax.vmap."
            )
        inside = jnp.all((x >= self._free.low) & (x <= self._free.high))
        within = jnp.clip(jnp.where(jnp.isnan(x), 0.0, x), self._free.low, self._free.high)
        found = self._problem.log_density(self._free.scaled(within))
        return jnp.where(inside, found, -jnp.inf)

    def plot(self, axes: Panels | None = None) -> np.ndarray:
        """Draws measurements and the fitted model, a panel for each channel; returns the matplotlib axes."""

        return plot_fit(self, axes)

    def plot_residuals(self, axes: Panels | None = None) -> np.ndarray:
        """Draws weighted residuals in order, and over the quantiles of the normal distribution."""

        return plot_residuals(self, axes)

    def plot_correlation(self, ax: Axes | None = None) -> Axes:
        """Draws the correlation matrix of the estimates."""

        return plot_correlation(self, ax)

    def __repr__(self) -> str:
        return f"<Fit of {', '.join(self.names)}: chi2 = {self.chi2:.6g}, {self.dof} degrees of freedom>"

    def __str__(self) -> str:
        lines = [aligned(self._estimate_rows), *self._remarks]
        if len(self.names) > 1:
            lines += ["correlation", aligned(self._correlation_rows)]
        lines += [f"indistinguishable: {combination}" for combination in self.indistinguishable]
        return "\n".join([*lines, *map(str, self.tests)])

    def html(self, path: str | os.PathLike[str] | None = None) -> str:
        """A report as one HTML file that loads nothing from elsewhere; returns its text, and writes it to a path.

        It has the estimates with intervals, the correlation, the residual tests, the pictures of `plot` and
        `plot_residuals`, all parameters, and the versions and the fingerprint that identify the fitted model.
        """
        return report(f"Fit of {type(self._problem.model).__name__}", self._report(), path)

    def _report(self) -> dict[str, object]:
        head, *rows = self._estimate_rows
        unclear = [f"indistinguishable: {combination}" for combination in self.indistinguishable]
        found: dict[str, object] = {
            "Estimates": [Table(head, rows), "\n".join([*self._remarks, *unclear])],
            "Measured and fitted": drawn(self.plot),
            "Residuals": [drawn(self.plot_residuals), "\n".join(map(str, self.tests))],
        }
        if len(self.names) > 1:
            found["Correlation"] = Table(("", *self.names), self._correlation_rows)
        return found if why_not_built(lambda: self.model) else found | model_parts(self.model)

    @property
    def _estimate_rows(self) -> list[list[str]]:
        share = f"{100 * self.level:g} %"
        head = ["parameter", "unit", "estimate", "std", f"low {share}", f"high {share}", ""]
        return [head, *(self._cells(i) for i in range(len(self.names)))]

    @property
    def _remarks(self) -> list[str]:
        rank = f"rank {self.rank} of {int(np.sum(~self.at_bound))}"
        name = f"sum of {self.loss.name} losses" if self.loss.is_robust else "chi2"
        found = [f"{name} {self.chi2:.6g}, {self.dof} degrees of freedom, {rank}"]
        if self.ends:
            near = self.ends[0].chi2 + SAME * max(self.ends[0].chi2, 1.0)
            same = sum(end.chi2 <= near for end in self.ends)
            found += [f"{same} of {len(self.ends)} starts lead to this sum of squares"]
        return [*found, *self.unexplained]

    def _cells(self, i: int) -> list[str]:
        scale = self._free.variables[i].scale
        estimate, low, high = (scale.value(numbers[i]) for numbers in (self.estimates, self.low, self.high))
        numbers = (estimate, scale.difference(self.std[i]), low, high)
        bound = "at its bound" if self.at_bound[i] else ""
        return [self.names[i], scale.unit, *(f"{number:.6g}" for number in numbers), bound]

    @property
    def _correlation_rows(self) -> list[list[str]]:
        rows = [
            [name, *(f"{value:.3f}" for value in row[: i + 1])]
            for i, (name, row) in enumerate(zip(self.names, self.correlation, strict=True))
        ]
        return [[*row, *[""] * (len(rows) + 1 - len(row))] for row in rows]


def plot_fit(fit: Fit[Any], axes: Panels | None) -> np.ndarray:
    """Measured values as dots and the fitted model as a line; as two sets of marks without times."""
    axes = _panels(axes, len(fit.channels), 1)
    for ax, channel in zip(axes[:, 0], fit.channels, strict=True):
        predicted, scale = fit.predicted[channel.label], channel.scale
        x = np.arange(1, len(predicted) + 1) if channel.times is None else channel.times
        ax.plot(x, scale.value(channel.measured), ".", color="0.45", markersize=4, label="measured")
        ax.plot(x, scale.value(predicted), "_" if channel.times is None else "-", color="tab:blue", label="fitted")
        ax.set_ylabel(scale.headed(channel.name), fontsize="small")
        ax.set_xlabel("number" if channel.times is None else "time [s]")
        ax.set_title(channel.experiment, fontsize="small")
        ax.legend(loc="best", fontsize="small", frameon=False)
        ax.grid(alpha=0.3)
    return axes


def plot_residuals(fit: Fit[Any], axes: Panels | None) -> np.ndarray:
    """A row for each channel: residuals in order, and their quantiles over those of the normal distribution."""
    axes = _panels(axes, len(fit.channels), 2)
    for (left, right), channel in zip(axes, fit.channels, strict=True):
        residuals = fit.residuals[channel.label]
        _draw_order(left, channel, residuals)
        residuals = residuals[np.isfinite(residuals)]
        quantiles = ndtri((np.arange(len(residuals)) + 0.5) / len(residuals))
        right.plot(quantiles, np.sort(residuals), ".", color="tab:blue", markersize=4)
        right.axline((0.0, 0.0), slope=1.0, color="0.5", linewidth=0.8)
        right.set_xlabel("quantile of the normal distribution")
        right.set_ylabel("residual / σ")
        right.grid(alpha=0.3)
    return axes


def _draw_order(ax: Axes, channel: Channel, residuals: np.ndarray) -> None:
    x = np.arange(1, len(residuals) + 1) if channel.times is None else channel.times
    ax.axhspan(-2.0, 2.0, color="tab:blue", alpha=0.08, linewidth=0)
    ax.axhline(0.0, color="0.5", linewidth=0.8)
    ax.plot(x, residuals, ".", color="tab:blue", markersize=4)
    ax.set_xlabel("number" if channel.times is None else "time [s]")
    ax.set_ylabel("residual / σ")
    ax.set_title(channel.label, fontsize="small")
    ax.grid(alpha=0.3)


def plot_correlation(fit: Fit[Any], ax: Axes | None) -> Axes:
    """A square for each pair, blue for negative and red for positive correlation."""
    n = len(fit.names)
    ax = given_or_new(ax, 2.6 + 0.6 * n, 1.8 + 0.6 * n)
    correlation = fit.correlation
    ax.imshow(correlation, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    for i, j in np.ndindex(n, n):
        value = correlation[i, j]
        if np.isfinite(value):
            colour = "white" if abs(value) > 0.6 else "black"
            ax.text(j, i, f"{value:.2f}", ha="center", va="center", fontsize="small", color=colour)
    ax.set_xticks(range(n), fit.names, rotation=35, ha="right", fontsize="small")
    ax.set_yticks(range(n), fit.names, fontsize="small")
    ax.set_title("correlation of the estimates", fontsize="medium")
    return ax


def plot_profile(profile: Profile, ax: Axes | None) -> Axes:
    """chi2 over the parameter, with the threshold and the interval."""
    ax = given_or_new(ax, 5.5, 3.5)
    value = profile.scale.value
    ax.plot(value(profile.values), profile.chi2, ".-", color="tab:blue")
    ax.axhline(profile.threshold, color="0.4", linewidth=0.8, linestyle="--")
    low, high = max(profile.low, profile.values[0]), min(profile.high, profile.values[-1])
    ax.axvspan(value(low), value(high), color="tab:blue", alpha=0.1, linewidth=0, label=f"{100 * profile.level:g} %")
    ax.set_xlabel(profile.scale.headed(profile.name))
    ax.set_ylabel("χ², the others fitted")
    ax.legend(loc="best", fontsize="small", frameon=False)
    ax.grid(alpha=0.3)
    return ax


def _panels(axes: Panels | None, rows: int, columns: int) -> np.ndarray:
    return panels(axes, rows, columns, (4.4 * columns + 1.6, 2.2 * rows + 0.4))
