"""Ideal sensors: no flow, no pressure drop."""

from typing import Self

from acausal import Component, Equations, eq

from ..blocks import Output
from ._interfaces import FluidPort


class PressureSensor(Component):
    """y = p in Pa."""

    port: FluidPort = FluidPort()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(no_flow=eq(self.port.q), reading=eq(self.y.value, self.port.p))


class FlowSensor(Component):
    """y = flow from a to b in m3/s."""

    a: FluidPort = FluidPort()
    b: FluidPort = FluidPort()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(
            no_drop=eq(self.a.p, self.b.p),
            continuity=eq(self.a.q + self.b.q),
            reading=eq(self.y.value, self.a.q),
        )
