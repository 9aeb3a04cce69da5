"""Massless, lossless transformers between a rod and a liquid, p q + f ds/dt = 0.

For mass and friction of the piston, connect translational parts to the rod; the compressibility of the liquid belongs
to the line. The rod side of the piston is open to the atmosphere.
"""

from typing import Self

import jax.numpy as jnp

from acausal import Component, Equations, Param, Scalar, eq, positive

from ..translational import Flange
from ._interfaces import FluidPort


class Cylinder(Component, partial=True):
    """Base class of single-acting cylinders."""

    bore: Param[Scalar, "m", positive]  # diameter of the piston
    rod: Flange = Flange()
    port: FluidPort = FluidPort()

    @property
    def area(self) -> Scalar:
        """A = pi/4 bore^2 in m2."""
        return 0.25 * jnp.pi * self.bore**2


class MasterCylinder(Cylinder):
    """A cylinder whose rod pushes liquid out as s increases: q = -A ds/dt into the port, f = A p into the rod.

    A = pi/4 bore^2. Not modelled: friction, leakage, the compressibility of the liquid, the mass of the piston.
    """

    def equations(self, d: Self) -> Equations:
        return dict(
            displacement=eq(self.port.q, -self.area * d.rod.s),
            force=eq(self.rod.f, self.area * self.port.p),
        )


class SlaveCylinder(Cylinder):
    """A cylinder whose liquid pushes the rod out as s increases: q = A ds/dt into the port, f = -A p into the rod.

    A = pi/4 bore^2. Not modelled: friction, leakage, the compressibility of the liquid, the mass of the piston.
    """

    def equations(self, d: Self) -> Equations:
        return dict(
            displacement=eq(self.port.q, self.area * d.rod.s),
            force=eq(self.rod.f, -self.area * self.port.p),
        )
