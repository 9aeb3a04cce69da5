"""Forces at frames and along lines, springs and dampers."""

from typing import Self

from acausal import Energy, Equations, Param, Scalar, Var, eq, nonnegative

from ..blocks import Input
from ..translational import Flange as Rod
from ._interfaces import AtFrame, Line


class ConstantForce(AtFrame):
    """Acts on a frame with a force and a torque that are constant in the axes of the plane."""

    fx: Param[Scalar, "N"] = 0.0  # force along x on the connected part
    fy: Param[Scalar, "N"] = 0.0  # force along y on the connected part
    tau: Param[Scalar, "N.m"] = 0.0  # torque on the connected part

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            drive_x=eq(self.frame.fx, -self.fx),
            drive_y=eq(self.frame.fy, -self.fy),
            drive=eq(self.frame.tau, -self.tau),
        )

    def energy(self) -> Energy:
        return Energy(supplied=self.fx * self.vx + self.fy * self.vy + self.tau * self.w)


class SignalForce(AtFrame):
    """Acts on a frame with forces in N and a torque in N.m, in the axes of the plane (PlanarMechanics `WorldForce`)."""

    fx: Input = Input()  # force along x on the connected part
    fy: Input = Input()  # force along y on the connected part
    tau: Input = Input()  # torque on the connected part

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            drive_x=eq(self.frame.fx, -self.fx.value),
            drive_y=eq(self.frame.fy, -self.fy.value),
            drive=eq(self.frame.tau, -self.tau.value),
        )

    def energy(self) -> Energy:
        return Energy(supplied=self.fx.value * self.vx + self.fy.value * self.vy + self.tau.value * self.w)


class Spring(Line):
    """A linear spring along the line between two frames, f = c (L - L_0)."""

    c: Param[Scalar, "N/m", nonnegative]  # stiffness
    L_0: Param[Scalar, "m", nonnegative]  # length of the unloaded spring

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(hooke=eq(self.f, self.c * (self.L - self.L_0)))

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.c * (self.L - self.L_0) ** 2)


class Damper(Line):
    """A linear damper along the line between two frames, f = d dL/dt."""

    d: Param[Scalar, "N.s/m", nonnegative]  # damping coefficient
    v: Var[Scalar, "m/s"] = 0.0  # speed at which the frames part

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            speed=eq(self.v, (self.x * d.x + self.y * d.y) / self.L),
            damping=eq(self.f, self.d * self.v),
        )

    def energy(self) -> Energy:
        return Energy(dissipated=self.d * self.v**2)


class LineForce(Line):
    """A translational element along the line between two frames (MultiBody `LineForceWithMass`, without mass).

    The position of `rod` is the length L. A cylinder, a spring with a stop or any other element between a
    `translational.Fixed` and `rod` acts between the frames.
    """

    rod: Rod = Rod()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(moved=eq(self.rod.s, self.L), driven=eq(self.f, -self.rod.f))
