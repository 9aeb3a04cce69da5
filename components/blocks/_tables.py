"""Lookup tables (as in MSL `Modelica.Blocks.Tables`)."""

from collections.abc import Mapping
from typing import ClassVar, Literal, Self

from acausal import (
    Equations,
    Param,
    Requirements,
    Scalar,
    Vector,
    eq,
    require,
)

from .._checks import sampled
from .._tables import cubic_in_samples, linear, located, monotone_cubic
from ._interfaces import SI2SO, SISO

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
