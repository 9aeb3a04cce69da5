"""Massless, lossless transformers between a rod and a liquid.

The piston's mass and friction are translational parts connected to the rod; the liquid's compressibility is in the
line. For both, p q + f ds/dt = 0. The rod side of the piston is open to the atmosphere.
"""

from typing import Self

import jax.numpy as jnp

from acausal import Component, Equations, Param, Scalar, eq, positive

from ..translational import Flange
from ._interfaces import FluidPort


class Cylinder(Component, partial=True):
    """A single-acting cylinder."""

    bore: Param[Scalar, "m", positive]  # diameter of the piston
    rod: Flange = Flange()
    port: FluidPort = FluidPort()

    @property
    def area(self) -> Scalar:
        """A = pi/4 bore^2 in m2."""
        return 0.25 * jnp.pi * self.bore**2


class MasterCylinder(Cylinder):
    """Pushing the rod in (s increases) presses liquid out: q = -A ds/dt into the port, f = A p into the rod.

    A = pi/4 bore^2. Not modelled: friction, leakage, the compressibility of the liquid, the mass of the piston.
    """

    def equations(self, d: Self) -> Equations:
        return dict(
            displacement=eq(self.port.q, -self.area * d.rod.s),
            force=eq(self.rod.f, self.area * self.port.p),
        )


class SlaveCylinder(Cylinder):
    """Liquid pressed in pushes the rod out (s increases): q = A ds/dt into the port, f = -A p into the rod.

    A = pi/4 bore^2. Not modelled: friction, leakage, the compressibility of the liquid, the mass of the piston.
    """

    def equations(self, d: Self) -> Equations:
        return dict(
            displacement=eq(self.port.q, self.area * d.rod.s),
            force=eq(self.rod.f, -self.area * self.port.p),
        )
