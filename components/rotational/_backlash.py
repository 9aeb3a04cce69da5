"""Play between two shafts."""

from typing import Self

from acausal import Discrete, Energy, Equations, Events, Param, Scalar, Var, eq, nonnegative

from .. import _contact as contact
from .. import _pieces as pieces
from ._interfaces import Compliant


class ElastoBacklash(Compliant):
    """A play between elastic stops with damping (MSL `ElastoBacklash`).

    With the deflection x = phi_rel - phi_rel0 -+ play/2 beyond the play, else 0: tau = c x + d w_rel, where the damping
    is limited to the size of c x, so that the torque is continuous at contact and the stops do not pull. Contact, and
    that this limit is met, are events.
    """

    c: Param[Scalar, "N.m/rad", nonnegative]  # stiffness
    d: Param[Scalar, "N.m.s/rad", nonnegative]  # damping coefficient
    play: Param[Scalar, "rad", nonnegative]  # total play
    phi_rel0: Param[Scalar, "rad"] = 0.0  # relative angle in the middle of the play
    w_rel: Var[Scalar, "rad/s"] = 0.0  # relative speed
    contact: Discrete[Scalar, "1"] = 1.0  # 0 at the lower stop, 1 within the play, 2 at the upper stop
    damped: Discrete[Scalar, "1"] = 1.0  # 0 or 2 where the damping is limited

    def _beyond(self) -> Scalar:
        x, half = self.phi_rel - self.phi_rel0, 0.5 * self.play
        return x - pieces.limited(x, self.contact, -half, half)

    def _most(self) -> Scalar:
        return pieces.size(self.c * self._beyond(), self.contact)

    def _damping(self) -> Scalar:
        return contact.damping(self.d * self.w_rel, self._most(), self.damped, self.contact != 1.0)

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            relative_speed=eq(self.w_rel, d.phi_rel),
            law=eq(self.tau, self.c * self._beyond() + self._damping()),
        )

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.c * self._beyond() ** 2, dissipated=self._damping() * self.w_rel)

    def events(self) -> Events:
        x, half = self.phi_rel - self.phi_rel0, 0.5 * self.play
        place = x - contact.SLACK * (1.0 - self.contact)
        ends = pieces.passes(place, self.contact, -half, half, name="contact")
        return ends | contact.limits(self.d, self.w_rel, self._most(), self.damped, self.contact != 1.0)
