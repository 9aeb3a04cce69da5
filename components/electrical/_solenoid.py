"""Coils with a movable armature."""

from typing import Self

from acausal import (
    Component,
    Energy,
    Equations,
    Param,
    Requirements,
    Scalar,
    Var,
    Vector,
    eq,
    nonnegative,
    positive,
    prefer,
    require,
)

from .._checks import sampled
from .._tables import monotone_cubic, monotone_cubic_integral
from ..translational import Flange as Rod
from ._interfaces import Pin


class Solenoid(Component):
    """A coil with resistance whose inductance falls with the air gap g = closed - s: L = L0 / (1 + g / g0).

    v = R i + dPsi/dt with Psi = L i. The force on the rod is i^2/2 dL/ds = i^2/2 L0 / g0 / (1 + g / g0)^2 towards
    larger s, with the inductance L0 at zero gap and the gap g0 that halves it (Kallenbach et al., `Elektromagnete`,
    linear iron). The rod must not move past the closed gap: see `translational.HardStop`. Not modelled: saturation,
    eddy currents, stray flux.
    """

    R: Param[Scalar, "ohm", nonnegative]  # resistance of the coil
    L0: Param[Scalar, "H", positive]  # inductance at zero gap
    g0: Param[Scalar, "m", positive]  # gap at which the inductance is halved
    closed: Param[Scalar, "m"]  # position of the rod at which the gap is closed
    Psi: Var[Scalar, "Wb", prefer] = 0.0  # flux linkage
    i: Var[Scalar, "A"] = 0.0  # current from p to n
    widening: Var[Scalar, "1"] = 1.0  # 1 + g / g0
    p: Pin = Pin()
    n: Pin = Pin()
    rod: Rod = Rod()

    def equations(self, d: Self) -> Equations:
        return dict(
            kirchhoff=eq(self.p.i + self.n.i),
            current=eq(self.i, self.p.i),
            gap=eq(self.g0 * self.widening, self.g0 + self.closed - self.rod.s),
            flux=eq(self.L0 * self.i, self.Psi * self.widening),
            coil=eq(self.p.v - self.n.v, self.R * self.i + d.Psi),
            # Psi^2 / (2 L0 g0), as the current is Psi (1 + g / g0) / L0.
            force=eq(2.0 * self.L0 * self.g0 * self.rod.f, -(self.Psi**2)),
        )

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.Psi * self.i, dissipated=self.R * self.i**2)


class DataSheetSolenoid(Component):
    """A coil from its data sheet: resistance, force over position at one current, inductance at one position.

    For linear iron the force is i^2/2 dL/ds. The curve F(s) at the current `rated` therefore gives the inductance L(s)
    = L_0 + 2/rated^2 times the integral of F from the first position. With it, v = R i + dPsi/dt, Psi = L(s) i, and the
    force is (i/rated)^2 F(s) towards larger s, consistent with one magnetic energy (Kallenbach et al.,
    `Elektromagnete`). F is a monotone cubic through its samples, extrapolated linearly. Not modelled: saturation, which
    makes the force grow less than with the square of the current, eddy currents, hysteresis, heating of the coil.
    """

    R: Param[Scalar, "ohm", nonnegative]  # resistance of the coil at its operating temperature
    L_0: Param[Scalar, "H", positive]  # inductance at the first position
    rated: Param[Scalar, "A", positive]  # current of the force curve
    positions: Param[Vector, "m"]  # positions of the rod, increasing
    forces: Param[Vector, "N"]  # magnetic forces at these positions, towards larger positions
    Psi: Var[Scalar, "Wb", prefer] = 0.0  # flux linkage
    i: Var[Scalar, "A"] = 0.0  # current from p to n
    L: Var[Scalar, "H", positive] = 1e-3  # inductance
    p: Pin = Pin()
    n: Pin = Pin()
    rod: Rod = Rod()

    def requirements(self) -> Requirements:
        return (*sampled(self, "forces", "positions"), require(self.forces >= 0.0, "forces must be nonnegative"))

    def equations(self, d: Self) -> Equations:
        table = self.positions, self.forces
        return dict(
            kirchhoff=eq(self.p.i + self.n.i),
            current=eq(self.i, self.p.i),
            inductance=eq(self.L, self.L_0 + 2.0 / self.rated**2 * monotone_cubic_integral(self.rod.s, *table)),
            flux=eq(self.Psi, self.L * self.i),
            coil=eq(self.p.v - self.n.v, self.R * self.i + d.Psi),
            force=eq(self.rod.f, -((self.i / self.rated) ** 2) * monotone_cubic(self.rod.s, *table)),
        )

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.Psi * self.i, dissipated=self.R * self.i**2)
