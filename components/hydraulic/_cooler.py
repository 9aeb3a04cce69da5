"""Oil cooler."""

from typing import Any, Self

import jax.numpy as jnp

from acausal import Equations, Param, Scalar, eq, nonnegative, positive

from .._limit import absolute
from ..thermal import HeatPort
from ._heat_carrier import HeatCarrier, with_carrier
from ._interfaces import TwoPort


class Cooler(TwoPort):
    """An oil cooler with a laminar resistance from a to b and a coolant at uniform temperature.

    dp = resistance q and Q = C [1 - exp(-UA/C)] (T_oil - T_coolant), with the capacity rate C = density
    specific_heat |q| (a heat exchanger with NTU = UA/C; Kays, London, `Compact Heat Exchangers`). The heat port `oil`
    has the oil temperature: it belongs to a `HeatCapacitor` for all the oil in the tank, which receives dp q and gives
    off Q. Connect the heat ports of other parts to it as well. No energy is lost.

    If the liquid carries heat, T_oil is the temperature of the inflow, that of `oil` is the temperature of the outflow,
    and the capacity is that of the liquid.
    """

    resistance: Param[Scalar, "Pa.s/m3", nonnegative]  # pressure drop per flow
    UA: Param[Scalar, "W/K", positive]  # heat transfer coefficient times area
    density: Param[Scalar, "kg/m3", positive] = 870.0  # density of the oil
    specific_heat: Param[Scalar, "J/(kg.K)", positive] = 1950.0  # specific heat of the oil
    oil: HeatPort = HeatPort()
    coolant: HeatPort = HeatPort()

    def equations(self, d: Self) -> Equations:
        heat = self._conductance() * (self._inlet(self.oil.T) - self.coolant.T)
        carried = sum(port.H_flow for _, port in self.thermal_ports())
        return super().equations(d) | dict(
            law=eq(self.dp, self.resistance * self.q),
            cooled=eq(self.oil.Q_flow, heat - self.dp * self.q - carried),
            warmed=eq(self.coolant.Q_flow, -heat),
        )

    def carrying(self, carrier: HeatCarrier) -> Self:
        return with_carrier(self, carrier)

    def shared_equations(self, d: Any) -> Equations:
        if self.carrier is None:
            return super().shared_equations(d)
        return self._carried_laws(self.carrier, self.oil.T)

    def _conductance(self) -> Scalar:
        """Heat flow per temperature difference."""
        per_volume = self.density * self.specific_heat if self.carrier is None else self.carrier.capacity
        capacity = per_volume * absolute(self.q)
        # Such a small flow leaves at the coolant temperature; UA/C would divide by zero.
        is_slow = capacity < 1e-2 * self.UA
        return jnp.where(is_slow, capacity, -capacity * jnp.expm1(-self.UA / jnp.where(is_slow, self.UA, capacity)))
