"""Entries of a fit: measured channels, ends of searches and combinations of parameters."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ..._units.display import Scale


class Channel(NamedTuple):
    """A measured quantity of an experiment. `rows` are the rows of its residuals; `scale` is that of the data."""

    experiment: str
    name: str
    unit: str
    times: np.ndarray | None
    measured: np.ndarray
    rows: slice
    is_estimated: bool  # whether the noise is
    group: int
    place: int
    scale: Scale = Scale()

    @property
    def n_values(self) -> int:
        """The number of measured values; missing ones are NaN."""
        return int(np.sum(np.isfinite(self.measured)))

    @property
    def label(self) -> str:
        """The name in tables and pictures."""
        return f"{self.experiment}: {self.name}"


class End(NamedTuple):
    """The end of a search from a start; chi2 is infinite if the model could not be run."""

    start: Float[np.ndarray, " n"]
    estimates: Float[np.ndarray, " n"]
    chi2: float


class Combination(NamedTuple):
    """A principal direction of the parameters in relative changes.

    All parameters change by `shares` times one factor. `std` is the relative standard deviation of this factor,
    infinite for an undetermined direction.
    """

    shares: Mapping[str, float]
    std: float

    def __str__(self) -> str:
        parts = [f"{share:+.2f} {name}" for name, share in self.shares.items() if abs(share) >= 0.1]
        known = "not determined" if np.isinf(self.std) else f"known to {100 * self.std:.3g} %"
        return f"{' '.join(parts)} (relative changes): {known}"
