"""Sobol' indices: shares of the variance of a result that parameters cause, alone and with others."""

import dataclasses

import numpy as np
from jaxtyping import Float

from ..._analyse.table import aligned
from ..._errors import SimulationError
from ..._extras import Axes
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
        from .spread_plots import plot_indices

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
