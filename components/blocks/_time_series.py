"""Measured or prescribed signals."""

from collections.abc import Mapping
from typing import ClassVar, Self

import jax.numpy as jnp

from acausal import (
    Equations,
    Param,
    Requirements,
    Vector,
    eq,
    require,
)

from .._checks import increasing, sampled
from .._tables import clamped, interval, line_of, monotone_cubic_of
from ._interfaces import SignalSource


class TimeSeries(SignalSource):
    """y(t) interpolated between samples; outside, the first or last value is held.

    With `smooth`, a cubic with continuous slope that does not overshoot the samples (Fritsch, Butland 1984); otherwise
    linear interpolation. Integration steps end at the samples, so none of them is missed.
    """

    elsewhere: ClassVar[Mapping[str, str]] = {"table": "times and values"}

    times: Param[Vector, "s"]  # increasing
    values: Param[Vector, ""]  # y at these times
    smooth: bool = True

    def requirements(self) -> Requirements:
        return sampled(self, "values", "times")

    def equations(self, d: Self) -> Equations:
        t = clamped(self.t, self.times)
        # A comparison of time alone: steps end where it changes, so the interval need not be held.
        i = interval(t, self.times)
        y = (monotone_cubic_of if self.smooth else line_of)(t, self.times, self.values, i)
        return dict(series=eq(self.y.value, y))


class Staircase(SignalSource):
    """y = values[i] from times[i] to times[i + 1]; outside, the first or last value is held.

    Integration steps end at the times, and derivatives with respect to them are exact.
    """

    times: Param[Vector, "s"]  # times of the steps, increasing; one more than values
    values: Param[Vector, ""]  # y between these times

    def requirements(self) -> Requirements:
        shape, wanted = jnp.shape(self.times), (len(jnp.ravel(self.values)) + 1,)
        if jnp.ndim(self.values) != 1 or shape != wanted or shape[0] < 2:
            return (require(False, "times must have one more element than values"),)
        return (require(increasing(self.times), "times must be increasing"),)

    def equations(self, d: Self) -> Equations:
        return dict(staircase=eq(self.y.value, self.values[interval(self.t, self.times)]))
