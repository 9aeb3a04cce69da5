"""Measured or prescribed signals."""

from typing import Self

from acausal import (
    Equations,
    Param,
    Requirements,
    Vector,
    eq,
)

from .._checks import sampled
from .._tables import clamped, linear, monotone_cubic
from ._interfaces import SignalSource


class TimeSeries(SignalSource):
    """y(t) through samples, held at the first and last value outside them.

    With `smooth`, a cubic with continuous slope that does not overshoot the samples (Fritsch, Butland 1984); else
    straight lines. Steps end at the samples, so that none of them is passed over.
    """

    times: Param[Vector, "s"]  # increasing
    values: Param[Vector, ""]  # y at these times
    smooth: bool = True

    def requirements(self) -> Requirements:
        return sampled(self, "values", "times")

    def equations(self, d: Self) -> Equations:
        t = clamped(self.t, self.times)
        y = monotone_cubic(t, self.times, self.values) if self.smooth else linear(t, self.times, self.values)
        return dict(series=eq(self.y.value, y))
