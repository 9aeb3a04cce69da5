"""Ideal sensors: no heat capacity, no temperature drop."""

from typing import Self

from acausal import Component, Equations, eq

from ..blocks import Output
from ._interfaces import HeatPort


class TemperatureSensor(Component):
    """y = T in K."""

    port: HeatPort = HeatPort()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(no_heat=eq(self.port.Q_flow), reading=eq(self.y.value, self.port.T))


class HeatFlowSensor(Component):
    """y = heat flow from a to b in W."""

    a: HeatPort = HeatPort()
    b: HeatPort = HeatPort()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(
            no_drop=eq(self.a.T, self.b.T),
            balance=eq(self.a.Q_flow + self.b.Q_flow),
            reading=eq(self.y.value, self.a.Q_flow),
        )


class RelativeTemperatureSensor(Component):
    """y = T_a - T_b in K (MSL `RelTemperatureSensor`)."""

    a: HeatPort = HeatPort()
    b: HeatPort = HeatPort()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(
            no_heat_a=eq(self.a.Q_flow),
            no_heat_b=eq(self.b.Q_flow),
            reading=eq(self.y.value, self.a.T - self.b.T),
        )
