"""Losses of pumps and motors, from coefficients or measured maps."""

import abc
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import scipy

from acausal import Events, Param, ParameterError, Record, Requirements, Scalar, Vector, nonnegative, positive, refuse

from .._checks import sampled
from .._limit import absolute, limited
from .._tables import monotone_cubic
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

    @classmethod
    def from_efficiencies(
        cls,
        *,
        displacement: Any,
        speeds: Any,
        pressures: Any,
        volumetric: Any,
        mechanical: Any,
        viscosity: Any,
        density: Any = 870.0,
    ) -> Self:
        """Coefficients that fit measured efficiencies of a pump best, by non-negative least squares.

        speeds in rad/s, pressure rises in Pa, and efficiencies, one row for each speed; viscosity in Pa.s and density
        in kg/m3 at the measurement. The residuals are those of the volumetric efficiency, 1 - slip/(D w), and of the
        inverse of the mechanical efficiency, 1 + drag/(D dp) (algorithm: Lawson, Hanson, `Solving Least Squares
        Problems`, 1974, ch. 23). Unlike a map, the law then holds at other viscosities.
        """
        w, dp = np.meshgrid(np.asarray(speeds, float), np.asarray(pressures, float), indexing="ij")
        eta_v, eta_m = np.asarray(volumetric, float), np.asarray(mechanical, float)
        if eta_v.shape != w.shape or eta_m.shape != w.shape:
            raise ParameterError(f"{cls.__name__}: efficiencies must have shape {w.shape}, speeds by pressures.")
        if not all(np.all((item > 0.0) & (item <= 1.0)) for item in (eta_v, eta_m)):
            raise ParameterError(f"{cls.__name__}: efficiencies must be above 0 and at most 1: 92 per cent is 0.92.")
        if np.min(w) <= 0.0 or np.min(dp) <= 0.0:
            raise ParameterError(f"{cls.__name__}: speeds and pressures must be positive: there is no efficiency at 0.")
        wanted = 1.0 - eta_v, 1.0 / eta_m - 1.0
        values = tuple(float(item) for item in (displacement, viscosity, density))
        if not min(values) > 0.0:
            raise ParameterError(f"{cls.__name__}: displacement, viscosity and density must be positive, got {values}.")
        found: dict[str, float] = {}
        for terms, right in zip(cls._shares(w, dp, *values), wanted, strict=True):
            columns = np.stack([term.ravel() for term in terms.values()], axis=1)
            scale = np.max(columns, axis=0)
            found |= dict(zip(terms, scipy.optimize.nnls(columns / scale, right.ravel())[0] / scale, strict=True))
        return cls(**found)

    @classmethod
    def _shares(
        cls, w: np.ndarray, dp: np.ndarray, displacement: float, viscosity: float, density: float
    ) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        """Slip over D w and drag over D dp for a unit of each coefficient."""
        slip = {"C_s": dp / (viscosity * w)}
        ones = np.ones_like(dp)
        return slip, {"C_v": viscosity * w / dp, "C_f": ones, "T_c": ones / (displacement * dp)}

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

    @classmethod
    def _shares(
        cls, w: np.ndarray, dp: np.ndarray, displacement: float, viscosity: float, density: float
    ) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        slip, drag = super()._shares(w, dp, displacement, viscosity, density)
        size = displacement ** (1.0 / 3.0)
        slip["C_st"] = np.sqrt(2.0 * dp / density) / (size * w)
        drag["C_h"] = 0.5 * density * (w * size) ** 2 / dp
        return slip, drag

    def slip(self, displacement: Scalar, dp: Scalar, w: Scalar, viscosity: Scalar, density: Scalar) -> Scalar:
        conductance = self.C_st * displacement ** (2.0 / 3.0) * jnp.sqrt(2.0 / density)
        return super().slip(displacement, dp, w, viscosity, density) + turbulent_flow(dp, conductance, self.p_t)

    def drag(self, displacement: Scalar, dp: Scalar, w: Scalar, viscosity: Scalar, density: Scalar) -> Scalar:
        churning = self.C_h * 0.5 * density * w * jnp.abs(w) * displacement ** (5.0 / 3.0)
        return super().drag(displacement, dp, w, viscosity, density) + churning


class MappedLosses(PumpLosses):
    """Slip and drag measured over speed and pressure, valid at the viscosity of the measurement.

    Monotone cubics (Fritsch, Butland 1984) interpolate over |dp| and then over |w|. Slip has the sign of dp and drag
    that of w, smoothed by tanh. Below the map, the values at its edge hold; above its highest pressure or speed, a run
    ends with an error. `MappedLosses.from_efficiencies(...)` takes the efficiencies of a data sheet. Differentiable
    with respect to all samples.
    """

    speeds: Param[Vector, "rad/s"]  # increasing
    pressures: Param[Vector, "Pa"]  # increasing
    slips: Param[Vector, "m3/s", nonnegative]  # slip flows, one row for each speed, one column for each pressure
    drags: Param[Vector, "N.m", nonnegative]  # loss torques, arranged likewise
    p_t: Param[Scalar, "Pa", positive] = 1e5  # width of the transition at zero dp
    w_t: Param[Scalar, "rad/s", positive] = 1.0  # width of the transition at zero w

    @classmethod
    def from_efficiencies(
        cls, *, displacement: Any, speeds: Any, pressures: Any, volumetric: Any, mechanical: Any
    ) -> Self:
        """Losses from pump efficiencies, one row for each speed: slip D w (1 - eta_v), drag D dp (1/eta_m - 1)."""
        w, dp = jnp.asarray(speeds, float), jnp.asarray(pressures, float)
        slips = displacement * w[:, None] * (1.0 - jnp.asarray(volumetric))
        drags = displacement * dp * (1.0 / jnp.asarray(mechanical) - 1.0)
        return cls(speeds=w, pressures=dp, slips=slips, drags=drags)

    def requirements(self) -> Requirements:
        return sampled(self, "slips", "speeds", "pressures") + sampled(self, "drags", "speeds", "pressures")

    def slip(self, displacement: Scalar, dp: Scalar, w: Scalar, viscosity: Scalar, density: Scalar) -> Scalar:
        del displacement, viscosity, density
        return self._at(self.slips, dp, w) * jnp.tanh(dp / self.p_t)

    def drag(self, displacement: Scalar, dp: Scalar, w: Scalar, viscosity: Scalar, density: Scalar) -> Scalar:
        del displacement, viscosity, density
        return self._at(self.drags, dp, w) * jnp.tanh(w / self.w_t)

    def events(self, dp: Scalar, w: Scalar) -> Events:
        is_beyond = (jnp.abs(dp) > self.pressures[-1]) | (jnp.abs(w) > self.speeds[-1])
        return dict(
            beyond=refuse(is_beyond, "pressure or speed is beyond the loss map: extend the map"),
        )

    def _at(self, samples: Vector, dp: Scalar, w: Scalar) -> Scalar:
        dp, w = (limited(absolute(x), knots[0], knots[-1]) for x, knots in ((dp, self.pressures), (w, self.speeds)))
        along = jnp.asarray(jax.vmap(lambda row: monotone_cubic(dp, self.pressures, row))(samples))
        return monotone_cubic(w, self.speeds, along)
