"""Ideal sources of pressure and flow, and ideal sensors, without flow or pressure drop."""

from typing import Any, Self

from acausal import Energy, Equations, Param, Scalar, eq

from ..blocks import Input, Output
from ._heat_carrier import HeatCarrier, with_carrier
from ._interfaces import FluidPart, FluidPort, MixedPart


class Source(MixedPart, partial=True):
    """A source with one port.

    If the liquid carries heat, the source delivers it at the temperature of the liquid record, or at that of `heat`.
    A `HeatCapacitor` there makes it a reservoir of a known mass.
    """

    port: FluidPort = FluidPort()

    def energy(self) -> Energy:
        return Energy(supplied=-self.port.p * self.port.q)

    def carrying(self, carrier: HeatCarrier) -> Self:
        return with_carrier(self, carrier)

    def shared_equations(self, d: Any) -> Equations:
        if self.heat is not None or self.carrier is None:
            return super().shared_equations(d)
        return self._carried_laws(self.carrier, self.carrier.temperature)

    def shared_energy(self, own: Energy) -> Energy:
        delivered = 0.0 if self.heat is not None else sum(port.H_flow for _, port in self.thermal_ports())
        return own._replace(supplied=own.supplied - delivered)


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
