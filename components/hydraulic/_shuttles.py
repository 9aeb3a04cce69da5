"""Shuttle and purge valves, moved by the higher of two pressures."""

from typing import Self

import jax.numpy as jnp

from acausal import Energy, Equations, Param, Scalar, eq, nonnegative, positive

from .._limit import limited
from ._interfaces import FluidPort, MixedPart
from ._valves import turbulent_flow


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
