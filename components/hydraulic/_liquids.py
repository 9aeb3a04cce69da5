"""Liquids as records: density, compressibility with entrained air and cavitation, viscosity.

The flow q of a `FluidPort` is the mass flow over `reference_density`, the density at atmospheric pressure and the
temperature of the liquid, so the flows at a node sum to zero as masses do. Components that need the volume flow under
pressure divide q by `relative_density`. Below, r(p) = rho(p) / reference_density, and p is above the atmosphere.
"""

import abc
from typing import Any

import jax.numpy as jnp

from acausal import Energy, Param, Record, Requirements, Scalar, positive, require
from acausal import nonnegative as nonneg

from .._series import expm1_over, log1p_over
from ._heat_carrier import Caloric

_TAIL = 40.0  # k, exponent of the bubble pressure below p_t: lower falls further below vapour, higher underflows

_FROZEN = 1e3  # m2/s, ten million times the viscosity of an oil in winter


class AnyLiquid(Record, partial=True):
    """Interface of all liquids. A volume V at the pressure p takes up the flow q = r dV/dt + V dr/dp dp/dt.

    r is the density over that at atmospheric pressure, to which the volume flow q refers.

    The power p q of a port assumes a constant density. Chambers count the remaining energy of the liquid exchanged, a
    fraction of about p/(2 K), as `supplied`: see `account`.
    """

    density: Param[Scalar, "kg/m3", positive]  # density at atmospheric pressure, and at T_ref if there is one
    bulk_modulus: Param[Scalar, "Pa", positive]  # tangent modulus K, at the same pressure and temperature

    @property
    @abc.abstractmethod
    def reference_density(self) -> Scalar:
        """Density in kg/m3 at atmospheric pressure, to which q refers."""

    @abc.abstractmethod
    def relative_density(self, p: Scalar) -> Scalar:
        """r(p), the density over `reference_density`."""

    @abc.abstractmethod
    def compressibility(self, p: Scalar) -> Scalar:
        """dr/dp in 1/Pa."""

    @abc.abstractmethod
    def kinematic_viscosity(self, p: Scalar, temperature: Scalar | None = None) -> Scalar:
        """Kinematic viscosity nu in m2/s at a temperature in K, by default that of the liquid."""

    @abc.abstractmethod
    def energy_density(self, p: Scalar) -> Scalar:
        """Compression energy e per volume in J/m3."""

    @abc.abstractmethod
    def potential(self, p: Scalar) -> Scalar:
        """Energy P carried by the liquid in J per m3 of q, that is in Pa; de/dp = P dr/dp."""

    def bulk_modulus_at(self, p: Scalar) -> Scalar:
        """Effective bulk modulus r / (dr/dp) in Pa, including entrained air."""
        return self.relative_density(p) / self.compressibility(p)

    def account(self, p: Any, volume: Any, inflow: Any, growth: Any = 0.0) -> Energy:
        """Energy account of a volume in m3 at the pressure p, with the inflow q and the growth rate in m3/s.

        It balances p q = d(V e)/dt + p dV/dt - supplied, with supplied = (e - P r + p) dV/dt + (P - p) q.
        """
        e, potential = self.energy_density(p), self.potential(p)
        change = (e - potential * self.relative_density(p) + p) * growth
        return Energy(stored=jnp.sum(volume * e), supplied=jnp.sum(change + (potential - p) * inflow))


class LinearLiquid(AnyLiquid):
    """The textbook liquid, dp/dt = K/V (q - dV/dt): constant density, bulk modulus and viscosity.

    Because the density is constant, mass is conserved only with a relative error of p/K. The liquid does not cavitate
    but sustains tension (Merritt, `Hydraulic Control Systems`, ch. 3).
    """

    viscosity: Param[Scalar, "m2/s", positive] = 30e-6  # kinematic viscosity

    @property
    def reference_density(self) -> Scalar:
        return self.density

    def relative_density(self, p: Scalar) -> Scalar:
        return jnp.ones_like(p)

    def compressibility(self, p: Scalar) -> Scalar:
        return jnp.ones_like(p) / self.bulk_modulus

    def kinematic_viscosity(self, p: Scalar, temperature: Scalar | None = None) -> Scalar:
        del temperature
        return self.viscosity * jnp.ones_like(p)

    def energy_density(self, p: Scalar) -> Scalar:
        return 0.5 * p**2 / self.bulk_modulus

    def potential(self, p: Scalar) -> Scalar:
        return p


class Liquid(AnyLiquid):
    """A liquid with entrained air at constant temperature T; `iso_vg_46()` and others are predefined.

    - Pressure: 1/r = (1 - air) (1 + m p/K)^(-1/m) + air (p_g0/p_g)^(1/n), where p_g = p + atmosphere - vapour pressure
      is the partial pressure of the air in the bubbles, which also contain vapour. The absolute pressure therefore
      stays above the vapour pressure and approaches it as the bubbles grow: cavitation. Mass is conserved (Nykanen,
      Esque, Ellman 2000; Gholizadeh, Burton, Schoenau 2011 for a survey of such laws).
    - For x = p + atmosphere - vapour pressure below p_t, p_g = p_t (1 + (p_t - x)/(k p_t))^(-k), k = 40, is never zero:
      the density is defined at any pressure, and has fallen to 1e-8 some 30 p_t below the vapour pressure.
    - With air = 0 there are no bubbles: the bulk modulus is K + m p, and the liquid sustains tension instead of
      cavitating, like a `LinearLiquid`.
    - Temperature, with D = T - T_ref: density/(1 + expansion D + curvature D^2), K exp(-softening D), and vapour
      pressure exp(-vaporisation (1/T - 1/T_ref)) by Clausius and Clapeyron.
    - Viscosity: ln((nu + shift)/unit) = Z_1 (T_1/T)^w through two points of a data sheet (Walther; ASTM D341 with a
      shift of 0.7 mm2/s), times exp(thickening p) (Barus).

    Valid up to a few 100 MPa, as long as m is constant. Not modelled: dissolution and release of air (Henry), heat of
    compression.
    """

    nu_1: Param[Scalar, "m2/s", positive]  # kinematic viscosity at T_1
    nu_2: Param[Scalar, "m2/s", positive]  # kinematic viscosity at T_2
    temperature: Param[Scalar, "K", positive] = 313.15  # T, temperature of the circuit
    air: Param[Scalar, "1", nonneg] = 0.005  # volume fraction of undissolved air at atmospheric pressure
    T_ref: Param[Scalar, "K", positive] = 288.15  # reference temperature of density, bulk modulus and vapour pressure
    T_1: Param[Scalar, "K", positive] = 313.15  # temperature of nu_1
    T_2: Param[Scalar, "K", positive] = 373.15  # temperature of nu_2
    stiffening: Param[Scalar, "1", nonneg] = 10.0  # m = dK/dp
    softening: Param[Scalar, "1/K", nonneg] = 0.0  # relative decrease of K with temperature
    expansion: Param[Scalar, "1/K"] = 0.0  # thermal expansion of the volume at T_ref
    curvature: Param[Scalar, "1/K2"] = 0.0  # quadratic coefficient of the thermal expansion
    thickening: Param[Scalar, "1/Pa", nonneg] = 0.0  # relative increase of the viscosity with pressure
    vapour_pressure: Param[Scalar, "Pa", nonneg] = 0.0  # absolute vapour pressure at T_ref
    vaporisation: Param[Scalar, "K", nonneg] = 0.0  # molar heat of vaporisation over the gas constant
    polytropic: Param[Scalar, "1", positive] = 1.4  # n, polytropic exponent of the air; 1 for slow changes
    atmosphere: Param[Scalar, "Pa", positive] = 101325.0  # absolute atmospheric pressure
    transition_pressure: Param[Scalar, "Pa", positive] = 1.0  # p_t, air pressure below which the law is extended
    shift: Param[Scalar, "m2/s", nonneg] = 0.7e-6  # shift of Walther's law
    unit: Param[Scalar, "m2/s", positive] = 1e-6  # unit of Walther's law, 1 mm2/s
    caloric: Caloric | None = None  # a liquid that has it carries heat
    source: str = ""  # source of the data

    def requirements(self) -> Requirements:
        return (
            require(self.air < 1.0, "air must be below 1"),
            require(self._vapour() < self.atmosphere, "vapour_pressure must be below atmosphere at the temperature"),
            require(
                self._vapour() + self.transition_pressure < self.atmosphere,
                "transition_pressure must be below atmosphere minus vapour_pressure",
            ),
            require(self.T_1 != self.T_2, "T_1 must differ from T_2"),
            require(self._expanded() > 0.0, "temperature must give a positive volume with expansion and curvature"),
            require(
                self.kinematic_viscosity(0.0) < _FROZEN,
                "temperature must be in K and give a viscosity below 1000 m2/s",
            ),
            require(self.nu_1 + self.shift > self.unit, "nu_1 must be above unit - shift"),
            require(self.nu_2 + self.shift > self.unit, "nu_2 must be above unit - shift"),
        )

    @property
    def reference_density(self) -> Scalar:
        return self.density / self._expanded()

    def relative_density(self, p: Scalar) -> Scalar:
        return 1.0 / (self._liquid(p) + self._bubbles(p))

    def compressibility(self, p: Scalar) -> Scalar:
        stiffer = 1.0 + self.stiffening * p / self._modulus()
        bubbles = self._bubbles(p) / (self.polytropic * self._bubble_scale(p))
        density = self.relative_density(p)
        return (self._liquid(p) / (self._modulus() * stiffer) + bubbles) * density * density

    def kinematic_viscosity(self, p: Scalar, temperature: Scalar | None = None) -> Scalar:
        warm = self.temperature if temperature is None else temperature
        z_1, z_2 = (jnp.log((nu + self.shift) / self.unit) for nu in (self.nu_1, self.nu_2))
        w = jnp.log(z_1 / z_2) / jnp.log(self.T_2 / self.T_1)
        nu = self.unit * jnp.exp(z_1 * (self.T_1 / warm) ** w) - self.shift
        return nu * jnp.exp(self.thickening * p)

    def energy_density(self, p: Scalar) -> Scalar:
        """P r - p, with the derivative P dr/dp."""
        return self.potential(p) * self.relative_density(p) - p

    def potential(self, p: Scalar) -> Scalar:
        """P, the integral of dp/r from 0 to p."""
        u, log = self._strain(p), self._log_until_width(p)
        base, width, n = self._above_vapour(0.0), self.transition_pressure, self.polytropic
        power = 1.0 + _TAIL / n
        liquid = self._modulus() * u * expm1_over((self.stiffening - 1.0) * u)
        bubbles = base * log * expm1_over((1.0 - 1.0 / n) * log)
        tail = -_TAIL * width / power * jnp.exp(-log / n) * jnp.expm1(power * self._log_growth(p))
        return (1.0 - self.air) * liquid + self.air * (bubbles + tail)

    def _expanded(self) -> Scalar:
        warmer = self.temperature - self.T_ref
        return 1.0 + self.expansion * warmer + self.curvature * warmer**2

    def _modulus(self) -> Scalar:
        return self.bulk_modulus * jnp.exp(-self.softening * (self.temperature - self.T_ref))

    def _vapour(self) -> Scalar:
        # Not `/`: numpy would warn about a temperature of zero before the requirement refuses it.
        colder = jnp.divide(1.0, self.temperature) - jnp.divide(1.0, self.T_ref)
        return self.vapour_pressure * jnp.exp(-self.vaporisation * colder)

    def least_pressure(self) -> Scalar:
        """The lowest pressure above the atmosphere in Pa: slightly below the vapour pressure, -inf without air."""
        lowest = self._vapour() - self.atmosphere - _TAIL * self.transition_pressure
        return jnp.where(self.air > 0.0, lowest, -jnp.inf)

    def _above_vapour(self, p: Scalar) -> Scalar:
        return p + (self.atmosphere - self._vapour())

    def _bubble_scale(self, p: Scalar) -> Scalar:
        """p_g over its slope dp_g/dp: p_g itself, increasing again below p_t as p falls."""
        above, width = self._above_vapour(p), self.transition_pressure
        return jnp.where(above < width, width + (width - above) / _TAIL, above)

    def _log_growth(self, p: Scalar) -> Scalar:
        """ln(1 + (p_t - x)/(k p_t)) if x is below p_t, otherwise 0."""
        missing = 1.0 - self._above_vapour(p) / self.transition_pressure
        return jnp.log1p(jnp.where(missing > 0.0, missing, 0.0) / _TAIL)

    def _log_until_width(self, p: Scalar) -> Scalar:
        """ln(max(x, p_t)/p_g0)."""
        above, width = self._above_vapour(p), self.transition_pressure
        return jnp.log(jnp.where(above < width, width, above) / self._above_vapour(0.0))

    def _strain(self, p: Scalar) -> Scalar:
        """ln(1 + m p/K)/m, or p/K for m = 0."""
        z = p / self._modulus()
        return z * log1p_over(self.stiffening * z)

    def _liquid(self, p: Scalar) -> Scalar:
        """Volume of the liquid over that of the mixture at atmospheric pressure."""
        return (1.0 - self.air) * jnp.exp(-self._strain(p))

    def _bubbles(self, p: Scalar) -> Scalar:
        log = self._log_until_width(p) - _TAIL * self._log_growth(p)
        return self.air * jnp.exp(-log / self.polytropic)
