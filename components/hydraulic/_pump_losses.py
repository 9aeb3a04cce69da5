"""Losses of pumps and motors."""

import abc

import jax.numpy as jnp

from acausal import Events, Param, Record, Scalar, nonnegative, positive

from ._valves import turbulent_flow


class PumpLosses(Record, partial=True):
    """Losses of flow and torque of a machine with displacement D at the pressure rise dp and the speed w."""

    @abc.abstractmethod
    def slip(self, displacement: Scalar, dp: Scalar, w: Scalar, viscosity: Scalar, density: Scalar) -> Scalar:
        """Leakage flow in m3/s from delivery to suction; viscosity in Pa.s."""

    @abc.abstractmethod
    def drag(self, displacement: Scalar, dp: Scalar, w: Scalar, viscosity: Scalar, density: Scalar) -> Scalar:
        """Loss torque in N.m against the rotation."""

    def events(self, dp: Scalar, w: Scalar) -> Events:
        """Events that stop a run outside the operating range; none by default."""
        del dp, w
        return {}


class LaminarLosses(PumpLosses, partial=True):
    """Wilson's loss coefficients."""

    C_s: Param[Scalar, "1", nonnegative] = 0.0  # laminar slip coefficient, about 1e-9 to 1e-8
    C_v: Param[Scalar, "1", nonnegative] = 0.0  # viscous drag coefficient, about 1e5
    C_f: Param[Scalar, "1", nonnegative] = 0.0  # pressure-dependent friction coefficient, a few per cent
    T_c: Param[Scalar, "N.m", nonnegative] = 0.0  # constant friction of seals and bearings
    w_t: Param[Scalar, "rad/s", positive] = 1.0  # width of the transition through rest

    def slip(self, displacement: Scalar, dp: Scalar, w: Scalar, viscosity: Scalar, density: Scalar) -> Scalar:
        return self.C_s * displacement * dp / viscosity

    def drag(self, displacement: Scalar, dp: Scalar, w: Scalar, viscosity: Scalar, density: Scalar) -> Scalar:
        dry = self.C_f * displacement * jnp.abs(dp) + self.T_c
        return self.C_v * displacement * viscosity * w + dry * jnp.tanh(w / self.w_t)


class WilsonLosses(LaminarLosses):
    """Laminar slip C_s D dp/mu; torque C_v D mu w + (C_f D |dp| + T_c) sign(w) (Wilson 1950).

    D is the displacement, dp the pressure rise, w the speed and mu the dynamic viscosity. The sign is smoothed:
    tanh(w/w_t). Without T_c, the efficiency is highest at mu w/dp = C_s + sqrt(C_s^2 + C_s (1 + C_f)/C_v).
    """


class SchloesserLosses(LaminarLosses):
    """Wilson's losses plus turbulent losses: slip C_st D^(2/3) sqrt(2 dp/rho), drag C_h (rho/2) w^2 D^(5/3).

    Schloesser 1961, with the density rho. The square root is smoothed within p_t as in `Orifice`.
    """

    C_st: Param[Scalar, "1", nonnegative] = 0.0  # turbulent slip coefficient
    C_h: Param[Scalar, "1", nonnegative] = 0.0  # hydrodynamic drag coefficient
    p_t: Param[Scalar, "Pa", positive] = 100.0  # width of the transition at zero pressure rise

    def slip(self, displacement: Scalar, dp: Scalar, w: Scalar, viscosity: Scalar, density: Scalar) -> Scalar:
        conductance = self.C_st * displacement ** (2.0 / 3.0) * jnp.sqrt(2.0 / density)
        return super().slip(displacement, dp, w, viscosity, density) + turbulent_flow(dp, conductance, self.p_t)

    def drag(self, displacement: Scalar, dp: Scalar, w: Scalar, viscosity: Scalar, density: Scalar) -> Scalar:
        churning = self.C_h * 0.5 * density * w * jnp.abs(w) * displacement ** (5.0 / 3.0)
        return super().drag(displacement, dp, w, viscosity, density) + churning
