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
from .._tables import clamped, interval, linear, monotone_cubic
from ._interfaces import SignalSource


class TimeSeries(SignalSource):
    """y(t) through samples, held at the first and last value outside them.

    With `smooth`, a cubic with continuous slope that does not overshoot the samples (Fritsch, Butland 1984); else
    straight lines. Steps end at the samples, so that none of them is passed over.
    """

    elsewhere: ClassVar[Mapping[str, str]] = {"table": "times and values"}

    times: Param[Vector, "s"]  # increasing
    values: Param[Vector, ""]  # y at these times
    smooth: bool = True

    def requirements(self) -> Requirements:
        return sampled(self, "values", "times")

    def equations(self, d: Self) -> Equations:
        t = clamped(self.t, self.times)
        y = monotone_cubic(t, self.times, self.values) if self.smooth else linear(t, self.times, self.values)
        return dict(series=eq(self.y.value, y))


class Staircase(SignalSource):
    """y = values[i] from times[i] until times[i + 1], held at the first and last value outside of the times.

    Steps end at the times, and derivatives with respect to these are exact.
    """

    times: Param[Vector, "s"]  # of the steps, increasing; one more than there are values
    values: Param[Vector, ""]  # y between these times

    def requirements(self) -> Requirements:
        shape, wanted = jnp.shape(self.times), (len(jnp.ravel(self.values)) + 1,)
        if jnp.ndim(self.values) != 1 or shape != wanted or shape[0] < 2:
            return (require(False, "times must be one more than values"),)
        return (require(increasing(self.times), "times must be increasing"),)

    def equations(self, d: Self) -> Equations:
        return dict(staircase=eq(self.y.value, self.values[interval(self.t, self.times)]))
