"""Thermal data of a liquid, and the heat that it carries from a node into a part."""

import copy
from typing import Any

import jax.numpy as jnp

from acausal import Param, Port, Record, Scalar, eq, positive

from .._series import expm1_over


class Caloric(Record):
    """Thermal data of a liquid that carries heat: see `fill`."""

    specific_heat: Param[Scalar, "J/(kg.K)", positive]  # at constant pressure, in the middle of the temperature range
    # Between a part and the node at its port while the liquid rests: 0.1 m of steel of 1 cm2 conducts 0.05 W/K.
    conductance: Param[Scalar, "W/K", positive] = 0.05


class HeatCarrier(Record):
    """The heat that a liquid carries from a node at T_n into a part at T, C = capacity q:

    H = C (T_n - T_0) for q > 0, C (T - T_0) for q < 0, plus G B(|C|/G) (T_n - T), with B(x) = x/(exp(x) - 1).

    This is the exact solution for steady convection and conduction between node and part (Patankar, `Numerical Heat
    Transfer and Fluid Flow`, ch. 5, exponential scheme): conduction while the liquid rests, upwind as soon as it flows.
    Heat counts from T_0.
    """

    capacity: Param[Scalar, "J/(m3.K)", positive]  # density times specific heat
    temperature: Param[Scalar, "K", positive]  # T_0, temperature of the circuit at the start and of ideal sources
    conductance: Param[Scalar, "W/K", positive]  # G, of liquid and walls between node and part

    def flow(self, q: Scalar, node: Scalar, inside: Scalar) -> Scalar:
        """H in W from a node to the inside of a part; temperatures in K."""
        rate = self.capacity * q
        peclet = jnp.abs(rate) / self.conductance
        conducted = self.conductance * jnp.exp(-peclet) / expm1_over(-peclet) * (node - inside)
        inwards, outwards = 0.5 * (rate + jnp.abs(rate)), 0.5 * (rate - jnp.abs(rate))
        return inwards * (node - self.temperature) + outwards * (inside - self.temperature) + conducted

    def balance(self, d: Any, heat: Any, gained: Scalar, volume: Any, inflow: Any) -> Any:
        """The balance of a volume of liquid at the temperature of its heat port, or of a part that holds none.

        `gained` in W is all heat into it, `inflow` in m3/s the rate at which its volume grows, referred to atmospheric
        density.
        """
        if volume is None:
            return eq(gained)
        stays = gained - self.capacity * inflow * (heat.T - self.temperature)
        return eq(self.capacity * volume * d.T, stays)

    def stored(self, volume: Any, heat: Any) -> Scalar:
        """Heat stored in a volume of liquid in J."""
        return self.capacity * volume * (heat.T - self.temperature)


def with_carrier(part: Any, carrier: HeatCarrier, **heats: Port) -> Any:
    """A copy of a part that carries heat, with those of the heat ports that it does not have already.

    A heat port that it has without a start temperature starts at that of the liquid.
    """
    made = {name: _starting(getattr(part, name), heat) for name, heat in heats.items()}
    return changed(part, carrier=carrier, **made)


def _starting(own: Any, heat: Any) -> Any:
    if own is None:
        return heat
    return own if own.T is not None or heat.T is None else changed(own, T=heat.T)


def changed(node: Any, **values: Any) -> Any:
    """A copy of a part or record with other values of some fields."""
    made = copy.copy(node)
    for name, value in values.items():
        object.__setattr__(made, name, value)
    return made
