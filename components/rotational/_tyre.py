"""Tyres with longitudinal slip."""

from typing import Any, Self

import jax.numpy as jnp

from acausal import (
    Component,
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

from ..translational import Flange as Rod
from ._interfaces import Flange


class MagicFormula(Component, partial=True):
    """Tyres that drive by slip, F = F_z D sin(C atan(B k - E (B k - atan(B k)))) with the slip k (magic formula).

    Pacejka, `Tire and Vehicle Dynamics`, section 4.3. The slip stiffness is dF/dk = B C D F_z, and the greatest force
    is D F_z if C >= 1. The defaults are those of a dry road; on snow, B = 5, C = 2, D = 0.3 and E = 1. One tyre can
    stand for several: F_z is then the sum of their normal forces. Rolling resistance is in `translational.Vehicle`.
    Connect an `Inertia` for the wheel to the shaft.
    """

    radius: Param[Scalar, "m", positive]  # effective rolling radius
    F_z: Param[Scalar, "N", nonnegative]  # normal force
    B: Param[Scalar, "1", positive] = 10.0  # stiffness factor
    C: Param[Scalar, "1", positive] = 1.9  # shape factor
    D: Param[Scalar, "1", nonnegative] = 1.0  # peak factor: the greatest coefficient of friction
    E: Param[Scalar, "1"] = 0.97  # curvature factor
    v_0: Param[Scalar, "m/s", positive] = 0.5  # speed below which the slip is damped
    v: Var[Scalar, "m/s"] = 0.0  # speed of the axle
    v_slip: Var[Scalar, "m/s"] = 0.0  # speed at which the contact patch slides backward
    slip: Var[Scalar, "1"] = 0.0  # k
    F: Var[Scalar, "N"] = 0.0  # driving force on the vehicle
    shaft: Flange = Flange()
    rod: Rod = Rod()  # moves with the axle

    def requirements(self) -> Requirements:
        return (
            require(self.C <= 2.0, "C must be at most 2, so that the force has the direction of the slip"),
            require(self.E <= 1.0, "E must be at most 1, so that the force has the direction of the slip"),
        )

    def equations(self, d: Any) -> Equations:
        x = self.B * self.slip
        formula = jnp.sin(self.C * jnp.arctan(x - self.E * (x - jnp.arctan(x))))
        return dict(
            speed=eq(self.v, d.rod.s),
            slides=eq(self.v_slip, self.radius * d.shaft.phi - self.v),
            formula=eq(self.F, self.F_z * self.D * formula),
            axle=eq(self.rod.f, -self.F),
            torque=eq(self.shaft.tau, self.radius * self.F),
        )

    def _rolled(self) -> Scalar:
        """Speed at which the contact patch is renewed."""
        return jnp.sqrt(self.v**2 + self.v_0**2)


class Tyre(MagicFormula):
    """A tyre in steady slip, k = v_slip / sqrt(v^2 + v_0^2) with v_slip = radius w - v. See `MagicFormula`.

    This is the longitudinal slip at speeds well above v_0. Below v_0 the tyre acts as a damper, so that it stands still
    without sliding; on a slope it creeps. For fast changes of the slip see `TransientTyre`.
    """

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(slip=eq(self.slip * self._rolled(), self.v_slip))

    def energy(self) -> Energy:
        return Energy(dissipated=self.F * self.v_slip)


class TransientTyre(MagicFormula):
    """A tyre whose slip lags over a rolled distance: sigma dk/dt + sqrt(v^2 + v_0^2) k = v_slip = radius w - v.

    See `MagicFormula` for the force. The relaxation length sigma is the slip stiffness over the longitudinal stiffness
    of the carcass, a few tenths of a metre for a passenger car (Pacejka, `Tire and Vehicle Dynamics`, chapter 7: single
    contact point transient tyre model, linear in k). Near rest the tyre is a spring of B C D F_z / sigma. Damping of
    the carcass is not modelled, so the force rings for longer than that of a real tyre.
    """

    sigma: Param[Scalar, "m", positive]  # relaxation length
    v_0: Param[Scalar, "m/s", positive] = 0.1  # speed below which the slip is damped
    slip: Var[Scalar, "1", prefer] = 0.0  # k
    deformation: Var[Scalar, "J"] = 0.0  # energy of the carcass, from its start value

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            relaxation=eq(self.sigma * d.slip + self._rolled() * self.slip, self.v_slip),
            deformation=eq(d.deformation, self.sigma * self.F * d.slip),
        )

    def energy(self) -> Energy:
        return Energy(stored=self.deformation, dissipated=self.F * self._rolled() * self.slip)
