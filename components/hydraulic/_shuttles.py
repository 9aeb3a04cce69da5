"""Valves that the higher one of two pressures moves."""

from typing import Self

import jax.numpy as jnp

from acausal import Component, Energy, Equations, Param, Scalar, eq, nonnegative, positive

from .._limit import limited
from ._interfaces import FluidPort
from ._valves import turbulent_flow


class ShuttleValve(Component):
    """Connects c with the higher one of a and b: the share of a's edge is 1/2 + (p_a - p_b)/(2 band), within 0 .. 1.

    Each edge passes K sqrt(dp) with K = rated_flow/sqrt(rated_drop), rounded at zero as in `Orifice`. The ball is
    without mass.
    """

    rated_flow: Param[Scalar, "m3/s", positive]  # through one edge, fully open
    rated_drop: Param[Scalar, "Pa", positive]  # at this pressure drop
    band: Param[Scalar, "Pa", positive] = 1e4  # difference of a and b that moves the ball over
    transition_pressure: Param[Scalar, "Pa", positive] = 100.0  # width of the root at zero
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


class PurgeValve(Component):
    """Lets liquid out of the lower one of two lines at c, to cool and clean a closed circuit: a flushing shuttle.

    Centred by springs, it joins a with c by the share (p_b - p_a - threshold)/band, within 0 .. 1, and b alike. Each
    edge passes K sqrt(dp) with K = rated_flow/sqrt(rated_drop), rounded at zero as in `Orifice`. What is let out, the
    charge pump has to replace; a `ReliefValve` behind c keeps the low pressure. The spool is without mass.
    """

    rated_flow: Param[Scalar, "m3/s", positive]  # through one edge, fully open
    rated_drop: Param[Scalar, "Pa", positive]  # at this pressure drop
    threshold: Param[Scalar, "Pa", nonnegative]  # difference of a and b at which it begins to open
    band: Param[Scalar, "Pa", positive]  # from closed to fully open
    transition_pressure: Param[Scalar, "Pa", positive] = 100.0  # width of the root at zero
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
