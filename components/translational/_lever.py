"""Lever."""

from typing import Self

from acausal import Component, Equations, Param, Scalar, eq, nonzero, positive

from ._interfaces import Flange


class Lever(Component):
    """A straight lever with the fulcrum between its ends: arm_b s_a + arm_a s_b = 0 and arm_a f_a = arm_b f_b.

    A negative arm_b puts b on the side of a. The fulcrum is the ground. With `fulcrum=Flange()` it is a flange: the
    positions are then relative to it, and it takes f_fulcrum = -(f_a + f_b). Rigid, massless, without friction. The
    positions are those along the arcs of the ends, or displacements at small angles.
    """

    arm_a: Param[Scalar, "m", positive]  # length from the fulcrum to a
    arm_b: Param[Scalar, "m", nonzero]  # length from the fulcrum to b
    a: Flange = Flange()
    b: Flange = Flange()
    fulcrum: Flange | None = None

    def equations(self, d: Self) -> Equations:
        balance = dict(balance=eq(self.arm_a * self.a.f, self.arm_b * self.b.f))
        if self.fulcrum is None:
            return balance | dict(turn=eq(self.arm_b * self.a.s + self.arm_a * self.b.s))
        turn = self.arm_b * (self.a.s - self.fulcrum.s) + self.arm_a * (self.b.s - self.fulcrum.s)
        return balance | dict(turn=eq(turn), reaction=eq(self.fulcrum.f + self.a.f + self.b.f))
