"""Cam with a translating follower."""

from typing import Self

from acausal import Component, Energy, Equations, Param, Scalar, Var, eq, nonnegative, prefer

from ..translational import Flange as Rod
from ._cam_profiles import CamProfile
from ._interfaces import Flange


class Cam(Component):
    """A cam that lifts an axially guided follower by s = l(phi).

    The contact is permanent and frictionless. By virtual work, the follower force F on the cam loads the shaft with
    F l'(phi): J dw/dt = tau + f l'(phi), where f = -F is the force into the follower's flange (Norton, `Cam Design
    and Manufacturing Handbook`). Not modelled: lift-off, friction, elasticity, mass of the follower.
    """

    profile: CamProfile
    J: Param[Scalar, "kg.m2", nonnegative] = 0.0  # moment of inertia about the shaft
    w: Var[Scalar, "rad/s", prefer] = 0.0  # speed of the shaft
    slope: Var[Scalar, "m/rad"] = 0.0  # l'(phi)
    torque: Var[Scalar, "N.m"] = 0.0  # F l'(phi), load of the follower on the shaft
    shaft: Flange = Flange()
    follower: Rod = Rod()

    def equations(self, d: Self) -> Equations:
        return dict(
            lift=eq(self.follower.s, self.profile.lift(self.shaft.phi)),
            speed=eq(self.w, d.shaft.phi),
            slope=eq(self.slope, self.profile.slope(self.shaft.phi)),
            virtual_work=eq(self.torque, -self.follower.f * self.slope),
            newton=eq(self.J * d.w, self.shaft.tau - self.torque),
        )

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.J * self.w**2)
