"""Heat exchangers with two streams, oil coolers, and their effectiveness."""

import abc
from typing import Any, Self

import jax.numpy as jnp

from acausal import Energy, Equations, Param, Record, Scalar, Var, eq, nonnegative, positive

from .._limit import absolute
from .._series import expm1_over
from ..thermal import HeatPort
from ._heat_carrier import HeatCarrier, with_carrier
from ._interfaces import FluidPart, FluidPort, TwoPort, upstream


class Arrangement(Record, partial=True):
    """How the two streams of a heat exchanger pass each other."""

    @abc.abstractmethod
    def effectiveness(self, units: Scalar, ratio: Scalar) -> Scalar:
        """Heat flow over the largest possible, from the number of transfer units N = UA/C_min and c = C_min/C_max."""


class CounterFlow(Arrangement):
    """(1 - exp(-x))/(1 - c exp(-x)) with x = N (1 - c), which is N/(1 + N) for c = 1."""

    def effectiveness(self, units: Scalar, ratio: Scalar) -> Scalar:
        shared = units * expm1_over(-units * (1.0 - ratio))
        return shared / (1.0 + ratio * shared)


class ParallelFlow(Arrangement):
    """(1 - exp(-N (1 + c)))/(1 + c)."""

    def effectiveness(self, units: Scalar, ratio: Scalar) -> Scalar:
        return -jnp.expm1(-units * (1.0 + ratio)) / (1.0 + ratio)


class CrossFlow(Arrangement):
    """Both streams unmixed: 1 - exp(N^0.22/c (exp(-c N^0.78) - 1)), within 4 % of the exact series."""

    def effectiveness(self, units: Scalar, ratio: Scalar) -> Scalar:
        spread = units**0.78
        return -jnp.expm1(-(units**0.22) * spread * expm1_over(-ratio * spread))


class ShellAndTube(Arrangement):
    """One shell pass and 2, 4, ... tube passes: 2/(1 + c + s (1 + exp(-N s))/(1 - exp(-N s))), s = sqrt(1 + c^2)."""

    def effectiveness(self, units: Scalar, ratio: Scalar) -> Scalar:
        s = jnp.sqrt(1.0 + ratio**2)
        return 2.0 / (1.0 + ratio + s / jnp.tanh(0.5 * units * s))


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
        return Energy(dissipated=sum(self._losses()))

    def carrying(self, carrier: HeatCarrier) -> Self:
        return with_carrier(self, carrier, outlet_1=HeatPort(), outlet_2=HeatPort())

    def shared_equations(self, d: Any) -> Equations:
        carrier, first, second = self.carrier, self.outlet_1, self.outlet_2
        if carrier is None or first is None or second is None:
            return super().shared_equations(d) | dict(exchange=eq(self.Q_flow))
        ports, (loss_1, loss_2) = dict(self.thermal_ports()), self._losses()
        laws: Equations = {}
        for number, outlet, gained in ((1, first, loss_1 - self.Q_flow), (2, second, loss_2 + self.Q_flow)):
            a, b = ports[f"a_{number}"], ports[f"b_{number}"]
            laws |= {
                f"heat_a_{number}": eq(a.H_flow, carrier.flow(a.q, a.T, outlet.T)),
                f"heat_b_{number}": eq(b.H_flow, carrier.flow(b.q, b.T, outlet.T)),
                f"heating_{number}": eq(a.H_flow + b.H_flow + outlet.Q_flow + gained),
            }
        inlet_1 = upstream(self.q_1, ports["a_1"], ports["b_1"])
        inlet_2 = upstream(self.q_2, ports["a_2"], ports["b_2"])
        return laws | dict(exchange=eq(self.Q_flow, self._conductance(carrier) * (inlet_1 - inlet_2)))

    def shared_energy(self, own: Energy) -> Energy:
        return own if self.carrier is None else own._replace(dissipated=0.0)

    def _conductance(self, carrier: HeatCarrier) -> Scalar:
        """Heat flow per difference of the inlet temperatures, e C_min."""
        rates = [carrier.capacity * jnp.abs(q) for q in (self.q_1, self.q_2)]
        least, most = jnp.minimum(*rates), jnp.maximum(*rates)
        slow = 0.01 * self.UA  # slower streams leave at the inlet temperature of the other one
        units, ratio = self.UA / jnp.maximum(least, slow), jnp.maximum(least, slow) / jnp.maximum(most, slow)
        return least * self.arrangement.effectiveness(units, ratio)

    def _losses(self) -> tuple[Scalar, Scalar]:
        return self.resistance_1 * self.q_1**2, self.resistance_2 * self.q_2**2


class Cooler(TwoPort):
    """An oil cooler with a laminar resistance from a to b and a coolant at uniform temperature.

    dp = resistance q and Q = C [1 - exp(-UA/C)] (T_oil - T_coolant), with the capacity rate C = density
    specific_heat |q| (a heat exchanger with NTU = UA/C; Kays, London, `Compact Heat Exchangers`). The heat port `oil`
    has the oil temperature: it belongs to a `HeatCapacitor` for all the oil in the tank, which receives dp q and gives
    off Q. Connect the heat ports of other parts to it as well. No energy is lost.

    If the liquid carries heat, T_oil is the temperature of the inflow, that of `oil` is the temperature of the outflow,
    and the capacity is that of the liquid.
    """

    resistance: Param[Scalar, "Pa.s/m3", nonnegative]  # pressure drop per flow
    UA: Param[Scalar, "W/K", positive]  # heat transfer coefficient times area
    density: Param[Scalar, "kg/m3", positive] = 870.0  # density of the oil
    specific_heat: Param[Scalar, "J/(kg.K)", positive] = 1950.0  # specific heat of the oil
    oil: HeatPort = HeatPort()
    coolant: HeatPort = HeatPort()

    def equations(self, d: Self) -> Equations:
        heat = self._conductance() * (self._inlet(self.oil.T) - self.coolant.T)
        carried = sum(port.H_flow for _, port in self.thermal_ports())
        return super().equations(d) | dict(
            law=eq(self.dp, self.resistance * self.q),
            cooled=eq(self.oil.Q_flow, heat - self.dp * self.q - carried),
            warmed=eq(self.coolant.Q_flow, -heat),
        )

    def carrying(self, carrier: HeatCarrier) -> Self:
        return with_carrier(self, carrier)

    def shared_equations(self, d: Any) -> Equations:
        if self.carrier is None:
            return super().shared_equations(d)
        return self._carried_laws(self.carrier, self.oil.T)

    def _conductance(self) -> Scalar:
        """Heat flow per temperature difference."""
        per_volume = self.density * self.specific_heat if self.carrier is None else self.carrier.capacity
        capacity = per_volume * absolute(self.q)
        # Such a small flow leaves at the coolant temperature; UA/C would divide by zero.
        is_slow = capacity < 1e-2 * self.UA
        return jnp.where(is_slow, capacity, -capacity * jnp.expm1(-self.UA / jnp.where(is_slow, self.UA, capacity)))
