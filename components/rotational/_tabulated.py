"""A torsional damper with a sampled characteristic."""

from typing import Self

from acausal import Energy, Equations, Param, Requirements, Scalar, Var, Vector, eq

from .._checks import damping
from .._tables import monotone_cubic
from ._interfaces import Compliant


class TabulatedDamper(Compliant):
    """A torsional damper with a sampled characteristic tau(w_rel), such as that of a viscous coupling.

    Monotone cubic interpolation with continuous slope, without extrema between the samples (Fritsch, Butland 1984);
    linear extrapolation beyond them. The origin is a sample, because a damper at rest carries no torque.
    """

    speeds: Param[Vector, "rad/s"]  # relative speeds, increasing, with 0 among them
    torques: Param[Vector, "N.m"]  # torques at these speeds, with the sign of the speed
    w_rel: Var[Scalar, "rad/s"] = 0.0  # relative speed

    def requirements(self) -> Requirements:
        return damping(self, "torques", "speeds")

    def torque(self) -> Scalar:
        """Torque at the current relative speed in N.m."""
        return monotone_cubic(self.w_rel, self.speeds, self.torques)

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            relative_speed=eq(self.w_rel, d.phi_rel),
            characteristic=eq(self.tau, self.torque()),
        )

    def energy(self) -> Energy:
        return Energy(dissipated=self.torque() * self.w_rel)
