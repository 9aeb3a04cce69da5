"""Massless, lossless transformers between a rod and a liquid, p q + f ds/dt = 0.

For mass and friction of the piston, connect translational parts to the rod; the compressibility of the liquid belongs
to the line. The rod side of the piston is open to the atmosphere.
"""

from typing import ClassVar, Self

import jax.numpy as jnp

from acausal import Energy, Equations, Param, Scalar, eq, positive

from ..translational import Flange
from ._interfaces import FluidPort, StatedVolume


class Cylinder(StatedVolume, partial=True):
    """Base class of single-acting cylinders.

    If the liquid carries heat, the cylinder holds `volume` at s = 0, and what the piston adds to it.
    """

    if_singular: ClassVar[str] = (
        "a cylinder that its piston has emptied has no temperature: add a stop, or increase its volume"
    )

    bore: Param[Scalar, "m", positive]  # diameter of the piston
    rod: Flange = Flange()
    port: FluidPort = FluidPort()

    @property
    def area(self) -> Scalar:
        """A = pi/4 bore^2 in m2."""
        return 0.25 * jnp.pi * self.bore**2

    def energy(self) -> Energy:
        return Energy()


class MasterCylinder(Cylinder):
    """A cylinder whose rod pushes liquid out as s increases: q = -A ds/dt into the port, f = A p into the rod.

    A = pi/4 bore^2. Not modelled: friction, leakage, the compressibility of the liquid, the mass of the piston.
    """

    def equations(self, d: Self) -> Equations:
        return dict(
            displacement=eq(self.port.q, -self.area * d.rod.s),
            force=eq(self.rod.f, self.area * self.port.p),
        )

    def held_liquid(self) -> Scalar:
        return self.volume - self.area * self.rod.s


class SlaveCylinder(Cylinder):
    """A cylinder whose liquid pushes the rod out as s increases: q = A ds/dt into the port, f = -A p into the rod.

    A = pi/4 bore^2. Not modelled: friction, leakage, the compressibility of the liquid, the mass of the piston.
    """

    def equations(self, d: Self) -> Equations:
        return dict(
            displacement=eq(self.port.q, self.area * d.rod.s),
            force=eq(self.rod.f, -self.area * self.port.p),
        )

    def held_liquid(self) -> Scalar:
        return self.volume + self.area * self.rod.s
