"""Friction without sticking events between a rod and the housing: smooth curves, and elastic bristles."""

from typing import Self

import jax.numpy as jnp

from acausal import Energy, Equations, Param, Requirements, Scalar, Var, eq, nonnegative, positive, prefer, require

from .._friction_laws import bristle_energy, bristle_force, bristle_slip, stribeck
from .._limit import absolute
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


class LuGreFriction(ToGround):
    """The LuGre model (Canudas de Wit, Olsson, Astrom, Lischinsky 1995), with the deflection z of elastic bristles.

    dz/dt = v - stiffness |v| z / g(v) with g(v) = Fc + (Fs - Fc) exp(-(v/vs)^2), and
    f = stiffness z + damping dz/dt + C v. Below break-away it is a stiff spring with presliding and hysteresis; while
    sliding, f tends to g(v) sign(v) + C v. Its only event is a reversal of v. With a large damping it can generate
    energy at high speeds.
    """

    Fc: Param[Scalar, "N", positive]  # Coulomb (sliding) force
    Fs: Param[Scalar, "N", positive]  # break-away force, at least Fc
    vs: Param[Scalar, "m/s", positive]  # Stribeck speed, at which the excess over Fc has dropped to 1/e
    stiffness: Param[Scalar, "N/m", positive]  # stiffness of the bristles, sigma_0
    damping: Param[Scalar, "N.s/m", nonnegative] = 0.0  # damping of the bristles, sigma_1
    C: Param[Scalar, "N.s/m", nonnegative] = 0.0  # viscous friction coefficient, sigma_2
    z: Var[Scalar, "m", prefer] = 0.0  # deflection of the bristles
    slip: Var[Scalar, "m/s"] = 0.0  # slip speed of the bristles

    def requirements(self) -> Requirements:
        return (require(self.Fc <= self.Fs, "Fc must be at most Fs"),)

    def _slip(self) -> Scalar:
        level = stribeck(self.v, self.Fc, self.Fs, self.vs)
        return bristle_slip(absolute(self.v), self.z, self.stiffness, level)

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            slip=eq(self.slip, self._slip()),
            bristles=eq(d.z, self.v - self.slip),
            friction=eq(self.flange.f, self._force()),
        )

    def _force(self) -> Scalar:
        return bristle_force(self.v, self.slip, self.z, stiffness=self.stiffness, damping=self.damping, viscous=self.C)

    def energy(self) -> Energy:
        return bristle_energy(self.v, self.slip, self.z, stiffness=self.stiffness, force=self._force())
