"""Smooth friction between a shaft and the ground."""

from typing import Self

import jax.numpy as jnp

from acausal import Energy, Equations, Param, Scalar, eq, nonnegative, positive

from .._friction_laws import stribeck
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
