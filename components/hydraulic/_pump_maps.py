"""Losses of pumps and motors from measured maps."""

from typing import Any, Self

import jax
import jax.numpy as jnp

from acausal import Events, Param, Requirements, Scalar, Vector, nonnegative, positive, refuse

from .._checks import sampled
from .._limit import absolute, limited
from .._tables import monotone_cubic
from ._pump_losses import PumpLosses


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
