"""Heat flow sources and prescribed temperature."""

from collections.abc import Mapping
from typing import ClassVar, Self

from acausal import Component, Energy, Equations, Param, Scalar, eq

from ..blocks import Input
from ._interfaces import HeatPort


class ConstantHeatFlow(Component):
    """Delivers a constant heat flow: Q_flow of the port is -heat_flow."""

    elsewhere: ClassVar[Mapping[str, str]] = {"Q_flow": "heat_flow"}

    heat_flow: Param[Scalar, "W"]  # heat flow delivered
    port: HeatPort = HeatPort()

    def equations(self, d: Self) -> Equations:
        return dict(delivery=eq(self.port.Q_flow, -self.heat_flow))

    def energy(self) -> Energy:
        return Energy(supplied=self.heat_flow)


class SignalHeatFlow(Component):
    """Delivers the heat flow u in W: Q_flow of the port is -u."""

    u: Input = Input()
    port: HeatPort = HeatPort()

    def equations(self, d: Self) -> Equations:
        return dict(delivery=eq(self.port.Q_flow, -self.u.value))

    def energy(self) -> Energy:
        return Energy(supplied=self.u.value)


class SignalTemperature(Component):
    """Surroundings at the temperature u in K, for any heat flow (MSL `PrescribedTemperature`)."""

    u: Input = Input()
    port: HeatPort = HeatPort()

    def equations(self, d: Self) -> Equations:
        return dict(temperature=eq(self.port.T, self.u.value))

    def energy(self) -> Energy:
        return Energy(supplied=-self.port.Q_flow)
