"""Springs between a rod and the housing, which is the ground."""

from typing import Self

from acausal import (
    Component,
    Energy,
    Equations,
    Param,
    Requirements,
    Scalar,
    Vector,
    eq,
    nonnegative,
)

from .._checks import sampled
from .._tables import monotone_cubic, monotone_cubic_integral
from ._interfaces import Flange


class ClutchSpring(Component):
    """A linear spring against the housing, f = preload + rate s."""

    rate: Param[Scalar, "N/m", nonnegative]  # stiffness
    preload: Param[Scalar, "N"] = 0.0  # force at s = 0
    flange: Flange = Flange()

    def force(self, s: Scalar) -> Scalar:
        """Force in N at a position in m."""
        return self.preload + self.rate * s

    def equations(self, d: Self) -> Equations:
        return dict(hooke=eq(self.flange.f, self.force(self.flange.s)))

    def energy(self) -> Energy:
        return Energy(stored=self.preload * self.flange.s + 0.5 * self.rate * self.flange.s**2)


class TabulatedSpring(Component):
    """A spring against the housing with a sampled characteristic f(s), such as the release curve of a clutch.

    Monotone cubic interpolation with continuous stiffness, without extrema between the samples (Fritsch, Butland 1984);
    linear extrapolation beyond them. Not modelled: hysteresis, wear.
    """

    positions: Param[Vector, "m"]  # increasing
    forces: Param[Vector, "N"]  # forces at these positions
    flange: Flange = Flange()

    def requirements(self) -> Requirements:
        return sampled(self, "forces", "positions")

    def force(self, s: Scalar) -> Scalar:
        """Force in N at a position in m."""
        return monotone_cubic(s, self.positions, self.forces)

    def equations(self, d: Self) -> Equations:
        force = monotone_cubic(self.flange.s, self.positions, self.forces)
        return dict(characteristic=eq(self.flange.f, force))

    def energy(self) -> Energy:
        return Energy(stored=monotone_cubic_integral(self.flange.s, self.positions, self.forces))
