"""Result of a fit to measurements: estimates, intervals, residual tests and profiles."""

import dataclasses

import numpy as np

from ..._analyse.table import aligned
from ..._errors import UnknownNameError, suggestion
from ..._extras import Axes, Panels
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
        """
        if name not in self.names:
            raise UnknownNameError(f"The fit has no parameter {name!r}.{suggestion(name, self.names)}")
        return profile(self, self.names.index(name), points, self.level if level is None else level)

    def plot(self, axes: Panels | None = None) -> np.ndarray:
        """Draws measurements and the fitted model, a panel for each channel; returns the matplotlib axes."""
        from .plots import plot_fit

        return plot_fit(self, axes)

    def plot_residuals(self, axes: Panels | None = None) -> np.ndarray:
        """Draws weighted residuals in order, and over the quantiles of the normal distribution."""
        from .plots import plot_residuals

        return plot_residuals(self, axes)

    def plot_correlation(self, ax: Axes | None = None) -> Axes:
        """Draws the correlation matrix of the estimates."""
        from .plots import plot_correlation

        return plot_correlation(self, ax)

    def __repr__(self) -> str:
        return f"<Fit of {', '.join(self.names)}: chi2 = {self.chi2:.6g}, {self.dof} degrees of freedom>"

    def __str__(self) -> str:
        share = f"{100 * self.level:g} %"
        head = ["parameter", "unit", "estimate", "std", f"low {share}", f"high {share}", ""]
        rows = [self._cells(i) for i in range(len(self.names))]
        rank = f"rank {self.rank} of {int(np.sum(~self.at_bound))}"
        lines = [aligned([head, *rows]), f"chi2 {self.chi2:.6g}, {self.dof} degrees of freedom, {rank}"]
        if self.ends:
            near = self.ends[0].chi2 + SAME * max(self.ends[0].chi2, 1.0)
            same = sum(end.chi2 <= near for end in self.ends)
            lines += [f"{same} of {len(self.ends)} starts lead to this sum of squares"]
        if len(self.names) > 1:
            lines += ["correlation", self._correlation_table]
        lines += [f"indistinguishable: {combination}" for combination in self.indistinguishable]
        return "\n".join([*lines, *map(str, self.tests)])

    def _cells(self, i: int) -> list[str]:
        scale = self._free.variables[i].scale
        estimate, low, high = (scale.value(numbers[i]) for numbers in (self.estimates, self.low, self.high))
        numbers = (estimate, scale.difference(self.std[i]), low, high)
        bound = "at its bound" if self.at_bound[i] else ""
        return [self.names[i], scale.unit, *(f"{number:.6g}" for number in numbers), bound]

    @property
    def _correlation_table(self) -> str:
        rows = [
            [name, *(f"{value:.3f}" for value in row[: i + 1])]
            for i, (name, row) in enumerate(zip(self.names, self.correlation, strict=True))
        ]
        return aligned([[*row, *[""] * (len(rows) + 1 - len(row))] for row in rows])
