"""Bristle friction: smooth, but with sticking."""

from typing import Self

from acausal import (
    Energy,
    Equations,
    Param,
    Requirements,
    Scalar,
    Var,
    eq,
    nonnegative,
    positive,
    prefer,
    require,
)

from .._friction_laws import bristle_energy, bristle_force, bristle_slip, stribeck
from .._limit import absolute
from ._interfaces import ToGround


class LuGreFriction(ToGround):
    """The LuGre model (Canudas de Wit, Olsson, Astrom, Lischinsky 1995), with the deflection z of elastic bristles.

    dz/dt = w - stiffness |w| z / g(w) with g(w) = Tc + (Ts - Tc) exp(-(w/ws)^2), and
    tau = stiffness z + damping dz/dt + C w. Below break-away it is a stiff spring with presliding and hysteresis; while
    sliding, tau tends to g(w) sign(w) + C w. Its only event is a reversal of w. With a large damping it can generate
    energy at high speeds.
    """

    Tc: Param[Scalar, "N.m", positive]  # Coulomb (sliding) torque
    Ts: Param[Scalar, "N.m", positive]  # break-away torque, at least Tc
    ws: Param[Scalar, "rad/s", positive]  # Stribeck speed, at which the excess over Tc has dropped to 1/e
    stiffness: Param[Scalar, "N.m/rad", positive]  # stiffness of the bristles, sigma_0
    damping: Param[Scalar, "N.m.s/rad", nonnegative] = 0.0  # damping of the bristles, sigma_1
    C: Param[Scalar, "N.m.s/rad", nonnegative] = 0.0  # viscous friction coefficient, sigma_2
    z: Var[Scalar, "rad", prefer] = 0.0  # deflection of the bristles
    slip: Var[Scalar, "rad/s"] = 0.0  # slip speed of the bristles

    def requirements(self) -> Requirements:
        return (require(self.Tc <= self.Ts, "Tc must be at most Ts"),)

    def _slip(self) -> Scalar:
        level = stribeck(self.w, self.Tc, self.Ts, self.ws)
        return bristle_slip(absolute(self.w), self.z, self.stiffness, level)

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            slip=eq(self.slip, self._slip()),
            bristles=eq(d.z, self.w - self.slip),
            friction=eq(self.flange.tau, self._torque()),
        )

    def _torque(self) -> Scalar:
        return bristle_force(self.w, self.slip, self.z, stiffness=self.stiffness, damping=self.damping, viscous=self.C)

    def energy(self) -> Energy:
        return bristle_energy(self.w, self.slip, self.z, stiffness=self.stiffness, force=self._torque())
