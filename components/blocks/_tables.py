"""Characteristics given by samples (as in MSL `Modelica.Blocks.Tables`)."""

from typing import Literal, Self

import jax.numpy as jnp

from acausal import Component, Equations, Param, ParameterError, Scalar, Vector, eq

from .._checks import check_samples
from .._tables import clamped, cubic_in_samples, linear, monotone_cubic
from ._interfaces import SI2SO, SISO

Extrapolation = Literal["hold", "linear"]


def _argument(u: Scalar, knots: Vector, extrapolation: Extrapolation) -> Scalar:
    return clamped(u, knots) if extrapolation == "hold" else u


def _check_extrapolation(owner: Component, extrapolation: str) -> None:
    if extrapolation not in ("hold", "linear"):
        raise ParameterError(f"{type(owner).__name__}.extrapolation must be 'hold' or 'linear', got {extrapolation!r}.")


class Table1D(SISO):
    """y(u) through samples, differentiable with respect to all of them (MSL `CombiTable1Ds`).

    With `smooth`, a cubic with continuous slope that does not overshoot the samples (Fritsch, Butland 1984); else
    straight lines, whose kinks cost the integrator steps. Beyond the samples, the outermost value is held, with a kink
    there, or the curve goes on as a line.
    """

    points: Param[Vector, ""]  # increasing values of u
    values: Param[Vector, ""]  # y at these points
    smooth: bool = True
    extrapolation: Extrapolation = "hold"

    def __check_init__(self) -> None:
        check_samples(self, "values", "points")
        _check_extrapolation(self, self.extrapolation)

    def equations(self, d: Self) -> Equations:
        u = _argument(self.u.value, self.points, self.extrapolation)
        curve = monotone_cubic if self.smooth else linear
        return dict(table=eq(self.y.value, curve(u, self.points, self.values)))


class Table2D(SI2SO):
    """y(u1, u2) through samples on a grid, differentiable with respect to all of them (MSL `CombiTable2Ds`).

    With `smooth`, piecewise bicubic with continuous slopes: at each knot that of the parabola through the neighbours,
    so that the surface can overshoot steep steps of the samples; else bilinear, whose kinks cost the integrator steps.
    Beyond the samples, the outermost values are held, with a kink there, or go on linearly.
    """

    points1: Param[Vector, ""]  # increasing values of u1
    points2: Param[Vector, ""]  # increasing values of u2
    values: Param[Vector, ""]  # y; a row for each point of u1, a column for each of u2
    smooth: bool = True
    extrapolation: Extrapolation = "hold"

    def __check_init__(self) -> None:
        check_samples(self, "values", "points1", "points2")
        _check_extrapolation(self, self.extrapolation)

    def equations(self, d: Self) -> Equations:
        u1 = _argument(self.u1.value, self.points1, self.extrapolation)
        u2 = _argument(self.u2.value, self.points2, self.extrapolation)
        curve = cubic_in_samples if self.smooth else linear
        row = jnp.asarray(curve(u1, self.points1, self.values))
        return dict(table=eq(self.y.value, curve(u2, self.points2, row)))
