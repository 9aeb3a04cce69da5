"""Smooth friction between a rod and the housing."""

from typing import Self

import jax.numpy as jnp

from acausal import Energy, Equations, Param, Scalar, eq, nonnegative, positive

from .._friction_laws import stribeck
from ._interfaces import ToGround


class ViscousFriction(ToGround):
    """Viscous friction against the housing, f = C v."""

    C: Param[Scalar, "N.s/m", nonnegative]  # friction coefficient

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(friction=eq(self.flange.f, self.C * self.v))

    def energy(self) -> Energy:
        return Energy(dissipated=self.C * self.v**2)


class SmoothStribeckFriction(ToGround):
    """Stribeck friction, smoothed at rest: it creeps where `StribeckFriction` sticks.

    f = [Fc + (Fs - Fc) exp(-(v/vs)^2)] tanh(v/v0), after Bo and Pavelescu (1982) with the sign replaced by tanh.

    Where a real rod sticks, this one creeps under any force f at about v0 atanh(f/Fs). A smaller width `v0` reduces the
    creep and makes the equations stiffer.
    """

    Fc: Param[Scalar, "N", nonnegative]  # Coulomb (sliding) force
    Fs: Param[Scalar, "N", nonnegative]  # break-away force
    vs: Param[Scalar, "m/s", positive]  # Stribeck speed, at which the excess over Fc has dropped to 1/e
    v0: Param[Scalar, "m/s", positive]  # width of the transition through rest

    def force(self) -> Scalar:
        """Friction force at the current speed."""
        return stribeck(self.v, self.Fc, self.Fs, self.vs) * jnp.tanh(self.v / self.v0)

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(friction=eq(self.flange.f, self.force()))

    def energy(self) -> Energy:
        return Energy(dissipated=self.force() * self.v)
