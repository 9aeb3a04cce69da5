"""Lever, rope and tackle."""

from typing import Self

from acausal import Component, Energy, Equations, Param, Scalar, Var, eq, nonnegative, nonzero, positive

from .._limit import limited, positive_part
from ._interfaces import Compliant, Flange


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


class Rope(Compliant):
    """An elastic rope that only pulls: f = EA x / length + d v_rel with the extension x = s_rel - length > 0.

    The damping force is limited to the absolute value of the first term, so that the rope never pushes. It is slack
    while s_rel < length; both changes are events. EA is the stiffness per strain, the modulus of the rope times its
    metallic cross-section (Feyrer, `Drahtseile`). With b above a, it carries what hangs at a. For a rope on a drum
    connect b to an `IdealRollingWheel` of `rotational`: the length is then the free length at the angle zero.
    """

    EA: Param[Scalar, "N", positive]  # force per strain
    length: Param[Scalar, "m", positive]  # free length without load
    d: Param[Scalar, "N.s/m", nonnegative] = 0.0  # damping coefficient
    v_rel: Var[Scalar, "m/s"] = 0.0  # relative speed

    def _extension(self) -> Scalar:
        return positive_part(self.s_rel - self.length)

    def _elastic(self) -> Scalar:
        return self.EA / self.length * self._extension()

    def _damping(self) -> Scalar:
        most = self._elastic()
        return limited(self.d * self.v_rel, -most, most)

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            relative_speed=eq(self.v_rel, d.s_rel),
            law=eq(self.f, self._elastic() + self._damping()),
        )

    def energy(self) -> Energy:
        stored = 0.5 * self.EA / self.length * self._extension() ** 2
        return Energy(stored=stored, dissipated=self._damping() * self.v_rel)


class Tackle(Component):
    """Pulley blocks with several falls of rope: s_a = falls s_b and f_b = -falls f_a; lossless and massless.

    The rope is hauled at a, and the load moves with b in the same direction. The upper block hangs on the ground.
    """

    falls: Param[Scalar, "1", positive]  # number of falls of rope that carry the load
    a: Flange = Flange()
    b: Flange = Flange()

    def equations(self, d: Self) -> Equations:
        return dict(
            kinematics=eq(self.a.s, self.falls * self.b.s),
            virtual_work=eq(self.falls * self.a.f + self.b.f),
        )
