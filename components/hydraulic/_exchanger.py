"""Heat exchanger with two streams."""

from typing import Any, Self

import jax.numpy as jnp

from acausal import Energy, Equations, Param, Scalar, Var, eq, nonnegative, positive

from ..thermal import HeatPort
from ._exchanger_laws import Arrangement
from ._heat_carrier import HeatCarrier, with_carrier
from ._interfaces import FluidPart, FluidPort


class HeatExchanger(FluidPart):
    """Two streams, a_1 to b_1 and a_2 to b_2, with laminar resistances, that exchange Q = e C_min (T_in1 - T_in2).

    C = density specific_heat |q| is the capacity rate of a stream; the effectiveness e depends on N = UA/C_min and
    C_min/C_max, with N limited to 100 (Kays, London, `Compact Heat Exchangers`). `arrangement` is `CounterFlow()`, or
    `ParallelFlow()`, `CrossFlow()`, `ShellAndTube()`. Both streams are of the liquid that `fill` gives them; if it does
    not carry heat, they exchange none. `Cooler` has a coolant at uniform temperature. The exchanger holds no liquid:
    put a `FlowVolume` or a `Pipe` behind it if its time constant matters. UA is constant.
    """

    UA: Param[Scalar, "W/K", positive]  # heat transfer coefficient times area
    resistance_1: Param[Scalar, "Pa.s/m3", nonnegative]  # pressure drop per flow
    resistance_2: Param[Scalar, "Pa.s/m3", nonnegative]
    arrangement: Arrangement
    q_1: Var[Scalar, "m3/s"] = 0.0  # flow from a_1 to b_1
    q_2: Var[Scalar, "m3/s"] = 0.0  # flow from a_2 to b_2
    Q_flow: Var[Scalar, "W"] = 0.0  # heat flow from stream 1 to stream 2
    a_1: FluidPort = FluidPort()
    b_1: FluidPort = FluidPort()
    a_2: FluidPort = FluidPort()
    b_2: FluidPort = FluidPort()
    outlet_1: HeatPort | None = None  # outflow of stream 1
    outlet_2: HeatPort | None = None  # outflow of stream 2

    def equations(self, d: Self) -> Equations:
        return dict(
            flow_1=eq(self.q_1, self.a_1.q),
            continuity_1=eq(self.a_1.q + self.b_1.q),
            drop_1=eq(self.a_1.p - self.b_1.p, self.resistance_1 * self.q_1),
            flow_2=eq(self.q_2, self.a_2.q),
            continuity_2=eq(self.a_2.q + self.b_2.q),
            drop_2=eq(self.a_2.p - self.b_2.p, self.resistance_2 * self.q_2),
        )

    def energy(self) -> Energy:
        return Energy(dissipated=self._loss(1) + self._loss(2))

    def carrying(self, carrier: HeatCarrier) -> Self:
        return with_carrier(self, carrier, outlet_1=HeatPort(), outlet_2=HeatPort())

    def shared_equations(self, d: Any) -> Equations:
        carrier, first, second = self.carrier, self.outlet_1, self.outlet_2
        if carrier is None or first is None or second is None:
            return super().shared_equations(d) | dict(exchange=eq(self.Q_flow))
        ports = dict(self.thermal_ports())
        laws: Equations = {}
        for number, outlet, sign in ((1, first, -1.0), (2, second, 1.0)):
            ends = {name: ports[f"{name}_{number}"] for name in "ab"}
            for name, port in ends.items():
                laws[f"heat_{name}_{number}"] = eq(port.H_flow, carrier.flow(port.q, port.T, outlet.T))
            gained = sum(port.H_flow for port in ends.values()) + outlet.Q_flow + self._loss(number)
            laws[f"heating_{number}"] = eq(gained + sign * self.Q_flow)
        rates = [carrier.capacity * jnp.abs(q) for q in (self.q_1, self.q_2)]
        inlets = [
            jnp.where(q > 0.0, ports[f"a_{number}"].T, ports[f"b_{number}"].T)
            for number, q in ((1, self.q_1), (2, self.q_2))
        ]
        least, most = (chosen(*rates) for chosen in (jnp.minimum, jnp.maximum))
        slow = 0.01 * self.UA  # slower streams leave at the inlet temperature of the other one
        units, ratio = self.UA / jnp.maximum(least, slow), jnp.maximum(least, slow) / jnp.maximum(most, slow)
        exchanged = least * self.arrangement.effectiveness(units, ratio) * (inlets[0] - inlets[1])
        return laws | dict(exchange=eq(self.Q_flow, exchanged))

    def shared_energy(self, own: Energy) -> Energy:
        return own if self.carrier is None else own._replace(dissipated=0.0)

    def _loss(self, number: int) -> Scalar:
        q, resistance = ((self.q_1, self.resistance_1), (self.q_2, self.resistance_2))[number - 1]
        return resistance * q**2
