"""Valves that open and close by events, with exact corners and hysteresis, unlike the smooth valves."""

from collections.abc import Mapping
from typing import ClassVar, Self

import jax.numpy as jnp

from acausal import (
    Discrete,
    Energy,
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

from .._limit import limited
from ._interfaces import FluidPort, MixedPart
from ._valves import Resistance, turbulent_flow

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


class ShuttleValve(MixedPart):
    """Connects c to the higher of the pressures at a and b: opening to a 1/2 + (p_a - p_b)/(2 band), within 0 .. 1.

    The opening to b is the complement. Each edge passes opening K sqrt(dp) with K = rated_flow/sqrt(rated_drop),
    smoothed at zero as in `Orifice`. The ball is massless.
    """

    rated_flow: Param[Scalar, "m3/s", positive]  # flow through one fully open edge
    rated_drop: Param[Scalar, "Pa", positive]  # pressure drop at rated_flow
    band: Param[Scalar, "Pa", positive] = 1e4  # pressure difference that moves the ball to its end
    transition_pressure: Param[Scalar, "Pa", positive] = 100.0  # width of the transition at zero pressure drop
    a: FluidPort = FluidPort()
    b: FluidPort = FluidPort()
    c: FluidPort = FluidPort()

    def equations(self, d: Self) -> Equations:
        share = limited(0.5 * (1.0 + self._lead()), 0.0, 1.0)
        conductance = self.rated_flow / jnp.sqrt(self.rated_drop)
        return dict(
            edge_a=eq(self.a.q, turbulent_flow(self.a.p - self.c.p, share * conductance, self.transition_pressure)),
            edge_b=eq(
                self.b.q, turbulent_flow(self.b.p - self.c.p, (1.0 - share) * conductance, self.transition_pressure)
            ),
            flow=eq(self.a.q + self.b.q + self.c.q),
        )

    def energy(self) -> Energy:
        return Energy(dissipated=(self.a.p - self.c.p) * self.a.q + (self.b.p - self.c.p) * self.b.q)

    def _lead(self) -> Scalar:
        return (self.a.p - self.b.p) / self.band


class PurgeValve(MixedPart):
    """A flushing shuttle: purges liquid from the low-pressure line at c, to cool and clean a closed circuit.

    Centred by springs, it connects a to c with the opening (p_b - p_a - threshold)/band, limited to 0 .. 1, and b
    likewise. Each edge passes opening K sqrt(dp) with K = rated_flow/sqrt(rated_drop), smoothed at zero as in
    `Orifice`. The charge pump must replace the purged flow; a `ReliefValve` behind c keeps the low pressure. The spool
    is massless.
    """

    rated_flow: Param[Scalar, "m3/s", positive]  # flow through one fully open edge
    rated_drop: Param[Scalar, "Pa", positive]  # pressure drop at rated_flow
    threshold: Param[Scalar, "Pa", nonnegative]  # pressure difference at which it begins to open
    band: Param[Scalar, "Pa", positive]  # pressure difference between closed and fully open
    transition_pressure: Param[Scalar, "Pa", positive] = 100.0  # width of the transition at zero pressure drop
    a: FluidPort = FluidPort()
    b: FluidPort = FluidPort()
    c: FluidPort = FluidPort()

    def equations(self, d: Self) -> Equations:
        lead = self.a.p - self.b.p
        return dict(
            edge_a=eq(self.a.q, self._edge(self.a.p, -lead)),
            edge_b=eq(self.b.q, self._edge(self.b.p, lead)),
            flow=eq(self.a.q + self.b.q + self.c.q),
        )

    def energy(self) -> Energy:
        return Energy(dissipated=(self.a.p - self.c.p) * self.a.q + (self.b.p - self.c.p) * self.b.q)

    def _edge(self, p: Scalar, lead: Scalar) -> Scalar:
        share = limited((lead - self.threshold) / self.band, 0.0, 1.0)
        conductance = share * self.rated_flow / jnp.sqrt(self.rated_drop)
        return turbulent_flow(p - self.c.p, conductance, self.transition_pressure)
