"""Liquids as records: density, compressibility with entrained air and cavitation, viscosity.

The flow q of a `FluidPort` is the mass flow over `reference_density`, the liquid's density at atmospheric pressure and
its temperature. So the flows at a node sum to zero as masses do; what needs the volume flow under pressure divides q
by `relative_density`. In what follows, r(p) = rho(p) / reference_density, and p counts from the atmosphere.
"""

import abc
from typing import Any

import jax.numpy as jnp

from acausal import Energy, Param, Record, Requirements, Scalar, positive, require
from acausal import nonnegative as nonneg

from .._series import expm1_over, log1p_over

_TAIL = 40.0  # k, by which bubbles hold ever less pressure: less of it sinks deeper, more of it ends in an underflow

_FROZEN = 1e3  # m2/s, ten million times as thick as an oil in winter


class AnyLiquid(Record, partial=True):
    """What components ask of a liquid; a volume V of it at the pressure p takes up q = r dV/dt + V dr/dp dp/dt.

    r is the density over that at atmospheric pressure, to which the flow by volume q refers.

    The power p q of a port counts the liquid as one of constant density. What an exchange of liquid carries beyond
    that, a share of about p/(2 K), is booked by chambers as `supplied`: see `account`.
    """

    density: Param[Scalar, "kg/m3", positive]  # at atmospheric pressure and, where there is one, T_ref
    bulk_modulus: Param[Scalar, "Pa", positive]  # tangent modulus K, likewise

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
        """nu in m2/s, at a temperature in K or at that of the liquid."""

    @abc.abstractmethod
    def energy_density(self, p: Scalar) -> Scalar:
        """Energy e in J/m3 that a volume of the liquid holds by its compression."""

    @abc.abstractmethod
    def potential(self, p: Scalar) -> Scalar:
        """Energy P in J per m3 of q that the liquid carries along, in Pa; with it de/dp = P dr/dp."""

    def bulk_modulus_at(self, p: Scalar) -> Scalar:
        """The effective bulk modulus r / (dr/dp) in Pa, entrained air included."""
        return self.relative_density(p) / self.compressibility(p)

    def account(self, p: Any, volume: Any, inflow: Any, growth: Any = 0.0) -> Energy:
        """The energy account of a volume in m3 that takes in q in m3/s and grows at a rate in m3/s, pushing with p.

        It balances p q = d(V e)/dt + p dV/dt - supplied, with supplied = (e - P r + p) dV/dt + (P - p) q.
        """
        e, potential = self.energy_density(p), self.potential(p)
        change = (e - potential * self.relative_density(p) + p) * growth
        return Energy(stored=jnp.sum(volume * e), supplied=jnp.sum(change + (potential - p) * inflow))


class LinearLiquid(AnyLiquid):
    """The liquid of the textbooks, dp/dt = K/V (q - dV/dt): constant density, bulk modulus and viscosity.

    Mass is conserved as far as the density is constant, with an error of p/K. There is no cavitation: the liquid takes
    tension (Merritt, `Hydraulic Control Systems`, ch. 3).
    """

    viscosity: Param[Scalar, "m2/s", positive] = 30e-6  # kinematic

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
    """A liquid with entrained air at constant temperature T; `iso_vg_46()` and its like make known ones.

    - Pressure: 1/r = (1 - air) (1 + m p/K)^(-1/m) + air (p_g0/p_g)^(1/n), where p_g = p + atmosphere - vapour pressure
      is what the air in a bubble bears, the other part being vapour. So the pressure stays above that of the vapour,
      and falls to it while the bubbles grow: that is cavitation. Mass is conserved (Nykanen, Esque, Ellman 2000;
      Gholizadeh, Burton, Schoenau 2011 for the survey of such laws).
    - From x = p_t on, p_g does not become zero with x = p + atmosphere - vapour pressure, but p_t (1 + (p_t - x)/
      (k p_t))^(-k), k = 40: there is a density at any pressure, and one of 1e-8 some 30 p_t below that of the vapour.
    - Temperature, with D = T - T_ref: density/(1 + expansion D + curvature D^2), K exp(-softening D), and vapour
      pressure exp(-vaporisation (1/T - 1/T_ref)) by Clausius and Clapeyron.
    - Viscosity: ln((nu + shift)/unit) = Z_1 (T_1/T)^w through two points of a data sheet (Walther; ASTM D341 with a
      shift of 0.7 mm2/s), times exp(thickening p) (Barus).

    Valid for a few 100 MPa, as far as m is constant. Not modelled: air that dissolves and comes out of solution
    (Henry), heat of compression.
    """

    nu_1: Param[Scalar, "m2/s", positive]  # kinematic viscosity at T_1
    nu_2: Param[Scalar, "m2/s", positive]  # and at T_2
    temperature: Param[Scalar, "K", positive] = 313.15  # T, of the circuit
    air: Param[Scalar, "1", positive] = 0.005  # share of the volume that is undissolved air at atmospheric pressure
    T_ref: Param[Scalar, "K", positive] = 288.15  # of density, bulk modulus and vapour pressure
    T_1: Param[Scalar, "K", positive] = 313.15
    T_2: Param[Scalar, "K", positive] = 373.15
    stiffening: Param[Scalar, "1", nonneg] = 10.0  # m = dK/dp
    softening: Param[Scalar, "1/K", nonneg] = 0.0  # relative decrease of K
    expansion: Param[Scalar, "1/K"] = 0.0  # of the volume, at T_ref
    curvature: Param[Scalar, "1/K2"] = 0.0  # of the volume over the temperature
    thickening: Param[Scalar, "1/Pa", nonneg] = 0.0  # relative increase of the viscosity
    vapour_pressure: Param[Scalar, "Pa", nonneg] = 0.0  # absolute
    vaporisation: Param[Scalar, "K", nonneg] = 0.0  # molar heat of vaporisation over the gas constant
    polytropic: Param[Scalar, "1", positive] = 1.4  # n of the air; 1 for slow changes
    atmosphere: Param[Scalar, "Pa", positive] = 101325.0  # absolute
    transition_pressure: Param[Scalar, "Pa", positive] = 1.0  # p_t
    shift: Param[Scalar, "m2/s", nonneg] = 0.7e-6  # of Walther's law
    unit: Param[Scalar, "m2/s", positive] = 1e-6  # in which Walther's law counts, mm2/s
    source: str = ""  # of the data

    def requirements(self) -> Requirements:
        return (
            require(self.air < 1.0, "air must be below 1"),
            require(self._vapour() < self.atmosphere, "vapour_pressure must be below atmosphere at the temperature"),
            require(
                self._vapour() + self.transition_pressure < self.atmosphere,
                "transition_pressure must be below the difference of atmosphere and vapour_pressure",
            ),
            require(self.T_1 != self.T_2, "T_1 must differ from T_2"),
            require(self._expanded() > 0.0, "temperature must be one at which expansion and curvature leave a volume"),
            require(
                self.kinematic_viscosity(0.0) < _FROZEN,
                "temperature must be one, in K, at which the law of the viscosity gives a liquid",
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
        """P r - p, of which the derivative is P dr/dp."""
        return self.potential(p) * self.relative_density(p) - p

    def potential(self, p: Scalar) -> Scalar:
        """P = integral of dp/r from 0 to p."""
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
        # Not `/`, by which numpy warns of the temperature of zero that a requirement is about to refuse.
        colder = jnp.divide(1.0, self.temperature) - jnp.divide(1.0, self.T_ref)
        return self.vapour_pressure * jnp.exp(-self.vaporisation * colder)

    def _above_vapour(self, p: Scalar) -> Scalar:
        return p + (self.atmosphere - self._vapour())

    def _bubble_scale(self, p: Scalar) -> Scalar:
        """p_g over its slope dp_g/dp: p_g itself, and below p_t what grows again as p falls."""
        above, width = self._above_vapour(p), self.transition_pressure
        return jnp.where(above < width, width + (width - above) / _TAIL, above)

    def _log_growth(self, p: Scalar) -> Scalar:
        """ln(1 + (p_t - x)/(k p_t)) where x is below p_t, else 0."""
        missing = 1.0 - self._above_vapour(p) / self.transition_pressure
        return jnp.log1p(jnp.where(missing > 0.0, missing, 0.0) / _TAIL)

    def _log_until_width(self, p: Scalar) -> Scalar:
        """ln(max(x, p_t)/p_g0)."""
        above, width = self._above_vapour(p), self.transition_pressure
        return jnp.log(jnp.where(above < width, width, above) / self._above_vapour(0.0))

    def _strain(self, p: Scalar) -> Scalar:
        """ln(1 + m p/K)/m, which is p/K for m = 0."""
        z = p / self._modulus()
        return z * log1p_over(self.stiffening * z)

    def _liquid(self, p: Scalar) -> Scalar:
        """Volume of the liquid over that of the mixture at atmospheric pressure."""
        return (1.0 - self.air) * jnp.exp(-self._strain(p))

    def _bubbles(self, p: Scalar) -> Scalar:
        log = self._log_until_width(p) - _TAIL * self._log_growth(p)
        return self.air * jnp.exp(-log / self.polytropic)
