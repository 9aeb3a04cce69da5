"""Valves that open and close by events, with exact corners and hysteresis, unlike the smooth valves."""

from collections.abc import Mapping
from typing import ClassVar, Self

import jax.numpy as jnp

from acausal import (
    Discrete,
    Equations,
    Events,
    Param,
    Requirements,
    Scalar,
    Var,
    eq,
    nonnegative,
    positive,
    require,
    when,
)

from ._valves import Resistance

ROUNDING = 1e-12  # relative rounding error of pressures


class IdealCheckValve(Resistance):
    """A check valve with a piecewise linear characteristic, open from a to b.

    Open: q = conductance (dp - cracking_pressure) + leakage cracking_pressure. Closed: q = leakage dp. The lines meet
    at dp = cracking_pressure, where the valve switches by an event. `CheckValve` is its smooth counterpart.
    """

    mode_names: ClassVar[Mapping[str, Mapping[float, str]]] = {"is_open": {0.0: "closed", 1.0: "open"}}

    conductance: Param[Scalar, "m3/(s.Pa)", positive]  # flow per pressure above the cracking pressure
    cracking_pressure: Param[Scalar, "Pa", nonnegative] = 2e4  # dp at which the valve opens
    leakage: Param[Scalar, "m3/(s.Pa)", nonnegative] = 0.0  # flow per pressure when closed
    beyond: Var[Scalar, "Pa"] = 0.0  # dp - cracking_pressure
    is_open: Discrete[Scalar, "1"] = 0.0  # 1 while open

    def equations(self, d: Self) -> Equations:
        slope = jnp.where(self.is_open > 0.5, self.conductance, self.leakage)
        return super().equations(d) | dict(
            beyond=eq(self.beyond, self.dp - self.cracking_pressure),
            law=eq(self.q, slope * self.beyond + self.leakage * self.cracking_pressure),
        )

    def events(self) -> Events:
        is_open = self.is_open > 0.5
        # The lines meet, so switching slightly late does no harm, and rounding of the pressures causes no chatter.
        rounding = ROUNDING * (jnp.abs(self.a.p) + jnp.abs(self.b.p))
        return dict(
            open=when(~is_open & (self.beyond > rounding), is_open=1.0),
            close=when(is_open & (self.beyond < -rounding), is_open=0.0),
        )


class SnapReliefValve(Resistance):
    """A relief valve with snap action: opens fully at `cracking_pressure` and closes at the lower `reseat_pressure`.

    Open: q = conductance dp. Closed: q = leakage dp. The flow jumps. If the relief flow is below
    conductance reseat_pressure, the valve cycles. `ReliefValve` is smooth and has no hysteresis.
    """

    mode_names: ClassVar[Mapping[str, Mapping[float, str]]] = {"is_open": {0.0: "closed", 1.0: "open"}}

    conductance: Param[Scalar, "m3/(s.Pa)", positive]  # flow per pressure when open
    cracking_pressure: Param[Scalar, "Pa", positive]  # dp at which the valve opens
    reseat_pressure: Param[Scalar, "Pa", positive]  # dp at which the valve closes
    leakage: Param[Scalar, "m3/(s.Pa)", nonnegative] = 0.0  # flow per pressure when closed
    is_open: Discrete[Scalar, "1"] = 0.0  # 1 while open

    def requirements(self) -> Requirements:
        return (
            require(
                self.reseat_pressure < self.cracking_pressure, "reseat_pressure must be smaller than cracking_pressure"
            ),
        )

    def equations(self, d: Self) -> Equations:
        slope = jnp.where(self.is_open > 0.5, self.conductance, self.leakage)
        return super().equations(d) | dict(law=eq(self.q, slope * self.dp))

    def events(self) -> Events:
        is_open = self.is_open > 0.5
        return dict(
            open=when(~is_open & (self.dp > self.cracking_pressure), is_open=1.0),
            close=when(is_open & (self.dp < self.reseat_pressure), is_open=0.0),
        )
