"""What takes heat out of a circuit."""

from typing import Self

import jax.numpy as jnp

from acausal import Equations, Param, Scalar, eq, nonnegative, positive

from .._limit import absolute
from ..thermal import HeatPort
from ._interfaces import TwoPort


class Cooler(TwoPort):
    """Oil passes from a to b against a laminar resistance, and gives heat to a coolant of one temperature.

    dp = resistance q and Q = C [1 - exp(-UA/C)] (T_oil - T_coolant), with the capacity flow C = density
    specific_heat |q| (a heat exchanger of NTU = UA/C; Kays, London, `Compact Heat Exchangers`). The temperature of the
    oil is that of the heat port `oil`, a `HeatCapacitor` of all the oil in the tank, which takes dp q and gives Q; to
    it go also the losses of parts with `heat=HeatPort()`. No energy is lost.
    """

    resistance: Param[Scalar, "Pa.s/m3", nonnegative]  # pressure drop per flow
    UA: Param[Scalar, "W/K", positive]  # heat transfer coefficient times surface
    density: Param[Scalar, "kg/m3", positive] = 870.0  # of the oil
    specific_heat: Param[Scalar, "J/(kg.K)", positive] = 1950.0  # of the oil
    oil: HeatPort = HeatPort()
    coolant: HeatPort = HeatPort()

    def equations(self, d: Self) -> Equations:
        heat = self._conductance() * (self.oil.T - self.coolant.T)
        return super().equations(d) | dict(
            law=eq(self.dp, self.resistance * self.q),
            cooled=eq(self.oil.Q_flow, heat - self.dp * self.q),
            warmed=eq(self.coolant.Q_flow, -heat),
        )

    def _conductance(self) -> Scalar:
        """Q per difference of temperature."""
        capacity = self.density * self.specific_heat * absolute(self.q)
        # So little flow leaves with the temperature of the coolant; the quotient would be one by zero.
        is_slow = capacity < 1e-2 * self.UA
        return jnp.where(is_slow, capacity, -capacity * jnp.expm1(-self.UA / jnp.where(is_slow, self.UA, capacity)))
