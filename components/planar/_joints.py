"""Joints."""

from typing import Self

import jax.numpy as jnp

from acausal import Equations, Param, Scalar, Var, eq, prefer

from ..rotational import Flange as Shaft
from ..translational import Flange as Rod
from ._interfaces import TwoFrames


class Revolute(TwoFrames):
    """A joint about which b turns against a by the angle phi (PlanarMechanics `Revolute`).

    Frictionless and free. With `shaft=rotational.Flange()` a drive, a spring or friction turns b against a.
    """

    phi: Var[Scalar, "rad", prefer] = 0.0  # angle of b against a
    w: Var[Scalar, "rad/s", prefer] = 0.0  # speed of b against a
    shaft: Shaft | None = None

    def equations(self, d: Self) -> Equations:
        laws = super().equations(d) | dict(
            same_x=eq(self.a.x, self.b.x),
            same_y=eq(self.a.y, self.b.y),
            angle=eq(self.b.phi, self.a.phi + self.phi),
            speed=eq(self.w, d.phi),
            balance=eq(self.a.tau + self.b.tau),
        )
        if self.shaft is None:
            return laws | dict(free=eq(self.b.tau))
        return laws | dict(turned=eq(self.shaft.phi, self.phi), driven=eq(self.b.tau + self.shaft.tau))


class Prismatic(TwoFrames):
    """A joint along which b slides against a by the distance s (PlanarMechanics `Prismatic`).

    Frictionless and free. With `rod=translational.Flange()` a drive, a spring or friction moves b against a.
    """

    angle: Param[Scalar, "rad"] = 0.0  # direction of the axis against the x axis of a
    s: Var[Scalar, "m", prefer] = 0.0  # distance of b from a along the axis
    v: Var[Scalar, "m/s", prefer] = 0.0  # speed of b against a
    rod: Rod | None = None

    def equations(self, d: Self) -> Equations:
        ex, ey = jnp.cos(self.a.phi + self.angle), jnp.sin(self.a.phi + self.angle)
        along = ex * self.b.fx + ey * self.b.fy
        laws = super().equations(d) | dict(
            position_x=eq(self.b.x, self.a.x + ex * self.s),
            position_y=eq(self.b.y, self.a.y + ey * self.s),
            rigid=eq(self.a.phi, self.b.phi),
            speed=eq(self.v, d.s),
            balance=eq(self.a.tau + self.b.tau, self.s * (ey * self.b.fx - ex * self.b.fy)),
        )
        if self.rod is None:
            return laws | dict(free=eq(along))
        return laws | dict(moved=eq(self.rod.s, self.s), driven=eq(along + self.rod.f))
