"""Work-precision curves: the time that an accuracy costs."""

import dataclasses
from collections.abc import Iterable

import numpy as np


@dataclasses.dataclass(frozen=True)
class Curve:
    """Runs of one program at several tolerances, from loose to tight: its errors, and its times in s."""

    name: str
    errors: np.ndarray
    times: np.ndarray

    def time_at(self, error: float) -> float:
        """Time in s for an error, between the runs along straight lines in the logarithms; NaN outside.

        A run that is more accurate than a tighter one is so by chance, so it counts with the error of that one.
        """
        errors = np.maximum.accumulate(np.maximum(self.errors, 1e-16)[::-1])
        times = self.times[::-1]
        log_time = np.interp(np.log(error), np.log(errors), np.log(times), left=np.nan, right=np.nan)
        return float(np.exp(log_time))


def best_time(curves: Iterable[Curve], error: float) -> float:
    """The least time in s that one of the curves needs for an error."""
    return float(np.nanmin([curve.time_at(error) for curve in curves]))
