"""Restrictions with a transition from laminar to turbulent flow that depends on the viscosity of the liquid."""

from typing import Self

import jax.numpy as jnp

from acausal import Equations, Param, Requirements, Scalar, eq, nonnegative, positive, require

from .._limit import limited
from ..blocks import Input
from ._liquids import AnyLiquid
from ._valves import Resistance, turbulent_flow


def transition(
    liquid: AnyLiquid, p: Scalar, T: Scalar | None, area: Scalar, discharge: Scalar, reynolds: Scalar
) -> Scalar:
    """Transition pressure drop in Pa from laminar to turbulent flow through a hole, (rho/2) (Re_t nu/(C_d d))^2.

    d = sqrt(4 area/pi) is the hydraulic diameter, nu is taken at the temperature T; Borutzky, Barnard, Thoma 2002.
    """
    diameter = jnp.sqrt(4.0 * area / jnp.pi)
    speed = reynolds * liquid.kinematic_viscosity(p, T) / (discharge * diameter)
    return 0.5 * liquid.reference_density * speed**2


class Hole(Resistance, partial=True):
    """A hole in a wall, with a liquid."""

    area: Param[Scalar, "m2", positive]  # fully open area A
    liquid: AnyLiquid
    discharge_coefficient: Param[Scalar, "1", positive] = 0.61  # C_d
    transition_reynolds: Param[Scalar, "1", positive] = 100.0  # Re_t

    def _flow(self, open_area: Scalar) -> Scalar:
        """Flow in m3/s; the transition to turbulent flow is that of the full area."""
        c, liquid = self.discharge_coefficient, self.liquid
        p, T = 0.5 * (self.a.p + self.b.p), self._temperature()
        width = transition(liquid, p, T, self.area, c, self.transition_reynolds)
        conductance = c * open_area * jnp.sqrt(2.0 / liquid.reference_density)
        return turbulent_flow(self.dp, conductance, width)


class LiquidOrifice(Hole):
    """An orifice of given area, q = C_d A sqrt(2 dp/rho), laminar below a Reynolds number.

    q = C_d A sqrt(2/rho) dp/(dp^2 + p_t^2)^(1/4) as in `Orifice`, with p_t = (rho/2) (Re_t nu/(C_d d))^2 from the
    liquid. The density is that at atmospheric pressure.
    """

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(law=eq(self.q, self._flow(self.area)))


class VariableOrifice(Hole):
    """A `LiquidOrifice` with the area leak + (area - leak) u, with the signal u limited to 0 .. 1.

    The transition to turbulent flow is that of the full area.
    """

    leak: Param[Scalar, "m2", nonnegative] = 0.0  # area that stays open
    u: Input = Input()

    def requirements(self) -> Requirements:
        return (require(self.leak <= self.area, "leak must be at most area"),)

    def equations(self, d: Self) -> Equations:
        area = self.leak + (self.area - self.leak) * limited(self.u.value, 0.0, 1.0)
        return super().equations(d) | dict(law=eq(self.q, self._flow(area)))


class AnnularGap(Resistance):
    """Laminar leakage along a piston or a spool, q = pi d c^3 (1 + 1.5 e^2)/(12 nu rho L) dp (Merritt, ch. 3)."""

    diameter: Param[Scalar, "m", positive]  # d
    clearance: Param[Scalar, "m", nonnegative]  # c, radial clearance
    length: Param[Scalar, "m", positive]  # L
    liquid: AnyLiquid
    eccentricity: Param[Scalar, "1", nonnegative] = 0.0  # e, relative to c: 0 centred, 1 touching

    def requirements(self) -> Requirements:
        return (require(self.eccentricity <= 1.0, "eccentricity must be at most 1"),)

    def equations(self, d: Self) -> Equations:
        nu = self.liquid.kinematic_viscosity(0.5 * (self.a.p + self.b.p), self._temperature())
        viscosity = self.liquid.reference_density * nu
        section = jnp.pi * self.diameter * self.clearance**3 * (1.0 + 1.5 * self.eccentricity**2)
        return super().equations(d) | dict(
            law=eq(12.0 * viscosity * self.length * self.q, section * self.dp),
        )

    def held_liquid(self) -> Scalar:
        return jnp.pi * self.diameter * self.clearance * self.length


class LocalLoss(Resistance):
    """A fitting, dp = zeta (rho/2) v |v| with v = q/area, laminar below a Reynolds number.

    zeta depends on the direction of flow and changes from one value to the other within the laminar transition. The
    pressures are total pressures: the kinetic energy of the flow is neglected. `bend`, `widening`, `drilled_corner` and
    `entry` give coefficients from the geometry (Idelchik, `Handbook of Hydraulic Resistance`; Crane TP-410).
    """

    area: Param[Scalar, "m2", positive]  # area to which v refers
    liquid: AnyLiquid
    zeta_ab: Param[Scalar, "1", positive]  # loss coefficient from a to b
    zeta_ba: Param[Scalar, "1", positive]  # loss coefficient from b to a
    transition_reynolds: Param[Scalar, "1", positive] = 100.0  # Re_t

    @classmethod
    def bend(cls, *, diameter: Scalar, liquid: AnyLiquid, radius: Scalar) -> "LocalLoss":
        """A smooth 90-degree bend of mean radius r: 0.21 sqrt(d/r) for r > d (Idelchik)."""
        zeta = 0.21 * jnp.sqrt(diameter / radius)
        return cls(area=0.25 * jnp.pi * diameter**2, liquid=liquid, zeta_ab=zeta, zeta_ba=zeta)

    @classmethod
    def widening(cls, *, diameter_a: Scalar, diameter_b: Scalar, liquid: AnyLiquid) -> "LocalLoss":
        """A step from a narrow pipe at a to a wide pipe at b: (1 - s)^2 by Borda and Carnot, backward (1 - s)/2.

        s is the ratio of the areas; v is the speed in the narrow pipe.
        """
        share = (diameter_a / diameter_b) ** 2
        return cls(
            area=0.25 * jnp.pi * diameter_a**2,
            liquid=liquid,
            zeta_ab=(1.0 - share) ** 2,
            zeta_ba=0.5 * (1.0 - share),
        )

    @classmethod
    def drilled_corner(cls, *, diameter: Scalar, liquid: AnyLiquid) -> "LocalLoss":
        """Two drilled holes that meet at 90 degrees with a sharp edge: 1.2 (Idelchik)."""
        return cls(area=0.25 * jnp.pi * diameter**2, liquid=liquid, zeta_ab=1.2, zeta_ba=1.2)

    @classmethod
    def entry(cls, *, diameter: Scalar, liquid: AnyLiquid) -> "LocalLoss":
        """A sharp-edged pipe entry from a large vessel at a: 0.5 into the pipe, 1 out of it."""
        return cls(area=0.25 * jnp.pi * diameter**2, liquid=liquid, zeta_ab=0.5, zeta_ba=1.0)

    def equations(self, d: Self) -> Equations:
        liquid, mean = self.liquid, 0.5 * (self.zeta_ab + self.zeta_ba)
        p, c = 0.5 * (self.a.p + self.b.p), 1.0 / jnp.sqrt(mean)
        width = transition(liquid, p, self._temperature(), self.area, c, self.transition_reynolds)
        towards = self.dp / jnp.sqrt(self.dp**2 + width**2)
        zeta = mean + 0.5 * (self.zeta_ab - self.zeta_ba) * towards
        conductance = self.area * jnp.sqrt(2.0 / (liquid.reference_density * zeta))
        return super().equations(d) | dict(law=eq(self.q, turbulent_flow(self.dp, conductance, width)))


class DrilledPassage(Resistance):
    """A drilled hole with sharp corners, dp = 128 mu L q/(pi d^4) + n zeta rho/2 v |v|, with v = q/A.

    Laminar and fully developed (Hagen, Poiseuille): check that `reynolds` stays below 2300. A 90-degree corner has
    zeta = 1.2 (Idelchik, `Handbook of Hydraulic Resistance`). Density and viscosity are those at atmospheric pressure.
    """

    diameter: Param[Scalar, "m", positive]  # d
    length: Param[Scalar, "m", positive]  # L, total length of all sections
    corners: Param[Scalar, "1", nonnegative]  # n, number of corners
    liquid: AnyLiquid
    zeta: Param[Scalar, "1", nonnegative] = 1.2  # loss coefficient of a corner

    @property
    def reynolds(self) -> Scalar:
        """Reynolds number v d/nu, with the sign of the flow."""
        return 4.0 * self.q / (jnp.pi * self.diameter * self._kinematic_viscosity())

    def equations(self, d: Self) -> Equations:
        density = self.liquid.reference_density
        speed = self.q / (0.25 * jnp.pi * self.diameter**2)
        friction = 128.0 * density * self._kinematic_viscosity() * self.length * self.q / (jnp.pi * self.diameter**4)
        corners = self.corners * self.zeta * 0.5 * density * speed * jnp.abs(speed)
        return super().equations(d) | dict(law=eq(self.dp, friction + corners))

    def held_liquid(self) -> Scalar:
        return 0.25 * jnp.pi * self.diameter**2 * self.length

    def _kinematic_viscosity(self) -> Scalar:
        return self.liquid.kinematic_viscosity(0.0, self._temperature())
