"""Valves that open and close by events: exact corners and hysteresis where `_valves.py` is smooth."""

from typing import Self

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

ROUNDING = 1e-12  # of pressures, relative


class IdealCheckValve(Resistance):
    """A non-return valve with two lines as its characteristic, open from a to b.

    Open, q = conductance (dp - cracking_pressure) + leakage cracking_pressure; closed, q = leakage dp: they meet at
    dp = cracking_pressure, which the valve passes by an event. `CheckValve` is its smooth counterpart.
    """

    conductance: Param[Scalar, "m3/(s.Pa)", positive]  # flow per pressure beyond cracking
    cracking_pressure: Param[Scalar, "Pa", nonnegative] = 2e4  # dp at which the valve opens
    leakage: Param[Scalar, "m3/(s.Pa)", nonnegative] = 0.0  # flow per pressure when closed
    beyond: Var[Scalar, "Pa"] = 0.0  # dp - cracking_pressure
    is_open: Discrete[Scalar, "1"] = 0.0  # 1 while it is open

    def equations(self, d: Self) -> Equations:
        slope = jnp.where(self.is_open > 0.5, self.conductance, self.leakage)
        return super().equations(d) | dict(
            beyond=eq(self.beyond, self.dp - self.cracking_pressure),
            law=eq(self.q, slope * self.beyond + self.leakage * self.cracking_pressure),
        )

    def events(self) -> Events:
        is_open = self.is_open > 0.5
        # The lines meet, so that a little late is as good; within their rounding, pressures may go to and fro.
        rounding = ROUNDING * (jnp.abs(self.a.p) + jnp.abs(self.b.p))
        return dict(
            open=when(~is_open & (self.beyond > rounding), is_open=1.0),
            close=when(is_open & (self.beyond < -rounding), is_open=0.0),
        )


class SnapReliefValve(Resistance):
    """A relief valve that snaps: fully open from `cracking_pressure` on, closed again from the lower `reseat_pressure`.

    Open, q = conductance dp; closed, q = leakage dp. The flow jumps. Where the flow to be relieved is below
    conductance reseat_pressure, it opens and closes again and again. `ReliefValve` is smooth and has no hysteresis.
    """

    conductance: Param[Scalar, "m3/(s.Pa)", positive]  # flow per pressure when open
    cracking_pressure: Param[Scalar, "Pa", positive]  # dp at which the valve opens
    reseat_pressure: Param[Scalar, "Pa", positive]  # dp at which it closes
    leakage: Param[Scalar, "m3/(s.Pa)", nonnegative] = 0.0  # flow per pressure when closed
    is_open: Discrete[Scalar, "1"] = 0.0  # 1 while it is open

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
