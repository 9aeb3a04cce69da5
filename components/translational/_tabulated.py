"""A damper with a sampled characteristic."""

from typing import Self

from acausal import Energy, Equations, Param, Requirements, Scalar, Var, Vector, eq

from .._checks import damping
from .._tables import monotone_cubic
from ._interfaces import Compliant


class TabulatedDamper(Compliant):
    """A damper with a sampled characteristic f(v_rel), such as that of a shock absorber.

    A shock absorber has more force in rebound (extension) than in bump.

    Monotone cubic interpolation with continuous slope, without extrema between the samples (Fritsch, Butland 1984);
    linear extrapolation beyond them. The origin is a sample, because a damper at rest carries no force.
    """

    speeds: Param[Vector, "m/s"]  # relative speeds, increasing, with 0 among them
    forces: Param[Vector, "N"]  # forces at these speeds, with the sign of the speed
    v_rel: Var[Scalar, "m/s"] = 0.0  # relative speed

    def requirements(self) -> Requirements:
        return damping(self, "forces", "speeds")

    def force(self) -> Scalar:
        """Force at the current relative speed in N."""
        return monotone_cubic(self.v_rel, self.speeds, self.forces)

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            relative_speed=eq(self.v_rel, d.s_rel),
            characteristic=eq(self.f, self.force()),
        )

    def energy(self) -> Energy:
        return Energy(dissipated=self.force() * self.v_rel)
