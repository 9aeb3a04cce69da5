"""Backlash between two shafts."""

from typing import Self

from acausal import Energy, Equations, Param, Scalar, Var, eq, nonnegative

from .._limit import absolute, limited
from ._interfaces import Compliant


class ElastoBacklash(Compliant):
    """Backlash between elastic stops with damping (MSL `ElastoBacklash`).

    tau = c x + d w_rel with the deflection x = phi_rel - phi_rel0 -+ play/2 beyond the play, and x = 0 within it. The
    damping torque is limited to |c x|, so that the torque is continuous at contact and the stops do not pull. Contact
    and reaching this limit are events.
    """

    c: Param[Scalar, "N.m/rad", nonnegative]  # stiffness
    d: Param[Scalar, "N.m.s/rad", nonnegative]  # damping coefficient
    play: Param[Scalar, "rad", nonnegative]  # total play
    phi_rel0: Param[Scalar, "rad"] = 0.0  # relative angle in the middle of the play
    w_rel: Var[Scalar, "rad/s"] = 0.0  # relative speed

    def _beyond(self) -> Scalar:
        x, half = self.phi_rel - self.phi_rel0, 0.5 * self.play
        return x - limited(x, -half, half)

    def _most(self) -> Scalar:
        return absolute(self.c * self._beyond())

    def _damping(self) -> Scalar:
        most = self._most()
        return limited(self.d * self.w_rel, -most, most)

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            relative_speed=eq(self.w_rel, d.phi_rel),
            law=eq(self.tau, self.c * self._beyond() + self._damping()),
        )

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.c * self._beyond() ** 2, dissipated=self._damping() * self.w_rel)
