"""Ideal sensors: no flow, no pressure drop."""

from typing import Self

from acausal import Equations, eq

from ..blocks import Output
from ._interfaces import FluidPart, FluidPort


class PressureSensor(FluidPart):
    """y = p in Pa."""

    port: FluidPort = FluidPort()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(no_flow=eq(self.port.q), reading=eq(self.y.value, self.port.p))

    def shared_equations(self, d: Self) -> Equations:
        return {f"no_heat_{name}": eq(port.H_flow) for name, port in self.thermal_ports()}


class FlowSensor(FluidPart):
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

    def shared_equations(self, d: Self) -> Equations:
        """The liquid flows from node to node without mixing."""
        if self.carrier is None:
            return {}
        (_, a), (_, b) = self.thermal_ports()
        return dict(heat=eq(a.H_flow, self.carrier.flow(a.q, a.T, b.T)), heat_balance=eq(a.H_flow + b.H_flow))
