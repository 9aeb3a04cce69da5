"""Pipe friction in round pipes, relative to laminar friction."""

import abc

import jax.numpy as jnp

from acausal import Param, Record, Scalar, nonnegative, positive


class PipeFriction(Record, partial=True):
    """A law for the Darcy friction factor f, dp/dx = f rho v |v|/(2 d); f = 64/Re for laminar flow."""

    @abc.abstractmethod
    def ratio(self, reynolds: Scalar, diameter: Scalar) -> Scalar:
        """f Re/64, the ratio of the friction to that of laminar flow."""


class LaminarFriction(PipeFriction):
    """f = 64/Re at any Reynolds number (Hagen, Poiseuille)."""

    def ratio(self, reynolds: Scalar, diameter: Scalar) -> Scalar:
        return jnp.ones_like(reynolds)


class NoFriction(PipeFriction):
    """f = 0: an ideal line."""

    def ratio(self, reynolds: Scalar, diameter: Scalar) -> Scalar:
        return jnp.zeros_like(reynolds)


class BlasiusFriction(PipeFriction):
    """The larger of 64/Re and 0.3164 Re^(-1/4), the latter for smooth pipes up to Re = 1e5 (Blasius 1913).

    They intersect at Re = 1187. The corner is smoothed, ratio = (1 + t^k)^(1/k) with the turbulent ratio t: there, f is
    too high by a factor of 2^(1/k), 6 % for k = 12; at twice or half that Re, it is within 1e-3.
    """

    sharpness: Param[Scalar, "1", positive] = 12.0  # k

    def ratio(self, reynolds: Scalar, diameter: Scalar) -> Scalar:
        # The power 3/4 has no derivative at zero; the laminar branch is exact there to rounding.
        turbulent = 0.3164 / 64.0 * jnp.where(reynolds > 1.0, reynolds, 1.0) ** 0.75
        return (1.0 + turbulent**self.sharpness) ** (1.0 / self.sharpness)


class ChurchillFriction(PipeFriction):
    """One smooth law for laminar, transitional and turbulent flow in smooth and rough pipes (Churchill 1977).

    f = 8 ((8/Re)^12 + (A + B)^(-3/2))^(1/12), A = (2.457 ln(1/((7/Re)^0.9 + 0.27 roughness/d)))^16 and
    B = (37530/Re)^16: laminar below Re = 2000, within 4 % of Colebrook and White above 4000.
    """

    roughness: Param[Scalar, "m", nonnegative] = 1.5e-6  # roughness of the wall; the default is for drawn tubes

    def ratio(self, reynolds: Scalar, diameter: Scalar) -> Scalar:
        # Below 1, the law is laminar to rounding, and its powers would overflow.
        re = jnp.where(reynolds > 1.0, reynolds, 1.0)
        rough = (2.457 * jnp.log((7.0 / re) ** 0.9 + 0.27 * self.roughness / diameter)) ** 16
        turbulent = (re / 8.0) ** 12 / (rough + (37530.0 / re) ** 16) ** 1.5
        return (1.0 + turbulent) ** (1.0 / 12.0)
