"""Heat storage, conduction and fixed temperature."""

from collections.abc import Mapping
from typing import ClassVar, Self

from acausal import Component, Energy, Equations, Param, Scalar, Var, eq, nonnegative, positive, prefer

from ._interfaces import HeatPort


class FixedTemperature(Component):
    """Surroundings at constant temperature, for any heat flow."""

    elsewhere: ClassVar[Mapping[str, str]] = {"T": "temperature"}

    temperature: Param[Scalar, "K", positive]  # temperature of the surroundings
    port: HeatPort = HeatPort()

    def equations(self, d: Self) -> Equations:
        return dict(temperature=eq(self.port.T, self.temperature))

    def energy(self) -> Energy:
        return Energy(supplied=-self.port.Q_flow)


class HeatCapacitor(Component):
    """A body of uniform temperature, C dT/dt = Q_flow. Not modelled: C that depends on T, phase change."""

    C: Param[Scalar, "J/K", positive]  # heat capacity
    T: Var[Scalar, "K", positive, prefer] = 293.15  # temperature
    port: HeatPort = HeatPort()

    def equations(self, d: Self) -> Equations:
        return dict(temperature=eq(self.T, self.port.T), heating=eq(self.C * d.T, self.port.Q_flow))

    def energy(self) -> Energy:
        return Energy(stored=self.C * self.T)


class ThermalConductor(Component):
    """Heat flow from a to b without storage, Q_flow = G (T_a - T_b).

    No energy is lost: the flow is heat already.
    """

    G: Param[Scalar, "W/K", nonnegative]  # thermal conductance
    Q_flow: Var[Scalar, "W"] = 0.0  # heat flow from a to b
    a: HeatPort = HeatPort()
    b: HeatPort = HeatPort()

    def equations(self, d: Self) -> Equations:
        return dict(
            flow_a=eq(self.a.Q_flow, self.Q_flow),
            flow_b=eq(self.b.Q_flow, -self.Q_flow),
            fourier=eq(self.Q_flow, self.G * (self.a.T - self.b.T)),
        )
