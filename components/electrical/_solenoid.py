"""A coil that pulls an armature."""

from typing import Self

from acausal import Component, Energy, Equations, Param, Scalar, Var, eq, nonnegative, positive, prefer

from ..translational import Flange as Rod
from ._interfaces import Pin


class Solenoid(Component):
    """A coil with resistance whose inductance falls with the air gap g = closed - s: L = L0 / (1 + g / g0).

    v = R i + dPsi/dt with Psi = L i, and the force on the rod is i^2/2 dL/ds = i^2/2 L0 / g0 / (1 + g / g0)^2 towards
    larger s, where L0 is the inductance of the closed gap, and g0 the gap that halves it (Kallenbach et al.,
    `Elektromagnete`, linear iron). The rod may not pass beyond the closed gap: see `translational.HardStop`. Not
    modelled: saturation, eddy currents, stray flux.
    """

    R: Param[Scalar, "ohm", nonnegative]  # resistance of the coil
    L0: Param[Scalar, "H", positive]  # inductance with the gap closed
    g0: Param[Scalar, "m", positive]  # gap at which the inductance is half of it
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
