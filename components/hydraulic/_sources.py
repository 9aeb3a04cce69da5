"""Ideal sources of pressure and flow."""

from typing import Self

from acausal import Component, Energy, Equations, Param, Scalar, eq

from ..blocks import Input
from ._interfaces import FluidPort


class Source(Component, partial=True):
    """A source with one port."""

    port: FluidPort = FluidPort()

    def energy(self) -> Energy:
        return Energy(supplied=-self.port.p * self.port.q)


class Tank(Source):
    """A reservoir open to the atmosphere, p = 0, for any flow. A circuit can have several."""

    def equations(self, d: Self) -> Equations:
        return dict(atmosphere=eq(self.port.p))


class ConstantPressure(Source):
    """Keeps a constant pressure at any flow."""

    pressure: Param[Scalar, "Pa"]  # pressure above the atmosphere

    def equations(self, d: Self) -> Equations:
        return dict(pressure=eq(self.port.p, self.pressure))


class SignalPressure(Source):
    """Keeps the pressure u in Pa at any flow."""

    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        return dict(pressure=eq(self.port.p, self.u.value))


class ConstantFlow(Source):
    """Delivers a constant flow at any pressure: q_port = -flow."""

    flow: Param[Scalar, "m3/s"]  # flow delivered

    def equations(self, d: Self) -> Equations:
        return dict(flow=eq(self.port.q, -self.flow))


class SignalFlow(Source):
    """Delivers the flow u in m3/s at any pressure: q_port = -u."""

    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        return dict(flow=eq(self.port.q, -self.u.value))
