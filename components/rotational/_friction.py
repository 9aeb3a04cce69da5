"""Friction without sticking events between a shaft and the ground: smooth curves, and elastic bristles."""

from typing import Self

import jax.numpy as jnp

from acausal import Energy, Equations, Param, Requirements, Scalar, Var, eq, nonnegative, positive, prefer, require

from .._friction_laws import bristle_energy, bristle_force, bristle_slip, stribeck
from .._limit import absolute
from ._interfaces import ToGround


class ViscousFriction(ToGround):
    """Viscous friction against the ground, tau = C w."""

    C: Param[Scalar, "N.m.s/rad", nonnegative]  # friction coefficient

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(friction=eq(self.flange.tau, self.C * self.w))

    def energy(self) -> Energy:
        return Energy(dissipated=self.C * self.w**2)


class SmoothStribeckFriction(ToGround):
    """Stribeck friction, smoothed at rest: it creeps where `StribeckFriction` sticks.

    tau = [Tc + (Ts - Tc) exp(-(w/ws)^2)] tanh(w/w0), after Bo and Pavelescu (1982) with the sign replaced by tanh.

    Where a real shaft sticks, this one creeps under any torque tau at about w0 atanh(tau/Ts). A smaller width `w0`
    reduces the creep and makes the equations stiffer.
    """

    Tc: Param[Scalar, "N.m", nonnegative]  # Coulomb (sliding) torque
    Ts: Param[Scalar, "N.m", nonnegative]  # break-away torque
    ws: Param[Scalar, "rad/s", positive]  # Stribeck speed, at which the excess over Tc has dropped to 1/e
    w0: Param[Scalar, "rad/s", positive]  # width of the transition through rest

    def torque(self) -> Scalar:
        """Friction torque at the current speed."""
        return stribeck(self.w, self.Tc, self.Ts, self.ws) * jnp.tanh(self.w / self.w0)

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(friction=eq(self.flange.tau, self.torque()))

    def energy(self) -> Energy:
        return Energy(dissipated=self.torque() * self.w)


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
