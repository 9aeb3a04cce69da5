"""Result of a fit to measurements: estimates, intervals, residual tests and profiles."""

import dataclasses
import os
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._analyse.table import aligned
from ..._errors import ArgumentError, UnknownNameError, suggestion
from ..._extras import Axes, Panels
from ..._report import Table, drawn, model_parts, report
from .._problem.corners import why_not_built
from .estimate import Estimate, M
from .profile import Profile, profile
from .residual_tests import ResidualTest, tests_of

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
        from .fit_plots import plot_fit

        return plot_fit(self, axes)

    def plot_residuals(self, axes: Panels | None = None) -> np.ndarray:
        """Draws weighted residuals in order, and over the quantiles of the normal distribution."""
        from .fit_plots import plot_residuals

        return plot_residuals(self, axes)

    def plot_correlation(self, ax: Axes | None = None) -> Axes:
        """Draws the correlation matrix of the estimates."""
        from .fit_plots import plot_correlation

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
