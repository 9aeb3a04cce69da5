"""Lookup tables (as in MSL `Modelica.Blocks.Tables`), and measured or prescribed signals."""

from collections.abc import Mapping
from typing import ClassVar, Literal, Self

import jax.numpy as jnp

from acausal import Equations, Param, Requirements, Scalar, Vector, eq, require

from .._checks import increasing, sampled
from .._tables import clamped, cubic_in_samples, interval, line_of, linear, located, monotone_cubic, monotone_cubic_of
from ._interfaces import SI2SO, SISO, SignalSource

Extrapolation = Literal["hold", "linear"]


def _argument(u: Scalar, points: Vector, extrapolation: Extrapolation) -> Scalar:
    """u, limited to the range of the table if the outermost value is held."""
    return located(u, points)[0] if extrapolation == "hold" else u


def _known(extrapolation: str) -> Requirements:
    is_known = extrapolation in ("hold", "linear")
    return (require(is_known, f"extrapolation must be 'hold' or 'linear', got {extrapolation!r}"),)


class Table1D(SISO):
    """Lookup table y(u), differentiable with respect to all samples (MSL `CombiTable1Ds`).

    With `smooth`, a cubic with continuous slope that does not overshoot the samples (Fritsch, Butland 1984); otherwise
    linear interpolation. Beyond the samples, the outermost value is held, or the curve continues linearly. Crossing a
    sample is an event.
    """

    elsewhere: ClassVar[Mapping[str, str]] = {"table": "points and values"}

    points: Param[Vector, ""]  # increasing values of u
    values: Param[Vector, ""]  # y at these points
    smooth: bool = True
    extrapolation: Extrapolation = "hold"

    def requirements(self) -> Requirements:
        return _known(self.extrapolation) + sampled(self, "values", "points")

    def equations(self, d: Self) -> Equations:
        u = _argument(self.u.value, self.points, self.extrapolation)
        curve = monotone_cubic if self.smooth else linear
        return dict(table=eq(self.y.value, curve(u, self.points, self.values)))


class Table2D(SI2SO):
    """Lookup table y(u1, u2) on a grid, differentiable with respect to all samples (MSL `CombiTable2Ds`).

    With `smooth`, piecewise bicubic with continuous slopes: the slope at a knot is that of the parabola through its
    neighbours, so the surface can overshoot steep steps of the samples. Otherwise bilinear. Beyond the samples, the
    outermost values are held, or continue linearly. Crossing a sample is an event.
    """

    elsewhere: ClassVar[Mapping[str, str]] = {"table": "points1 and points2 with values"}

    points1: Param[Vector, ""]  # increasing values of u1
    points2: Param[Vector, ""]  # increasing values of u2
    values: Param[Vector, ""]  # y, one row for each point of u1, one column for each point of u2
    smooth: bool = True
    extrapolation: Extrapolation = "hold"

    def requirements(self) -> Requirements:
        return _known(self.extrapolation) + sampled(self, "values", "points1", "points2")

    def equations(self, d: Self) -> Equations:
        u1 = _argument(self.u1.value, self.points1, self.extrapolation)
        u2 = _argument(self.u2.value, self.points2, self.extrapolation)
        curve = cubic_in_samples if self.smooth else linear
        row = curve(u1, self.points1, self.values)
        return dict(table=eq(self.y.value, curve(u2, self.points2, row)))


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
