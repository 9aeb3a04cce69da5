"""Parts of heating and cooling circuits: circulation pump, volume in a line, radiator, thermostatic valve."""

from typing import Any, Self

import jax.numpy as jnp

from acausal import (
    Energy,
    Equations,
    Param,
    Requirements,
    Scalar,
    Var,
    eq,
    nonnegative,
    nonzero,
    positive,
    prefer,
    require,
)

from .._limit import limited
from ..thermal import HeatPort
from ._interfaces import TwoPort
from ._valves import Resistance, turbulent_flow


class CirculationPump(TwoPort):
    """A centrifugal pump at constant speed, p_b - p_a = dp_max (1 - q |q|/q_max^2), from a to b.

    With a design point at q_max/2 and 3/4 dp_max, this is the one-point curve of Rossman, `EPANET 2 Users Manual`,
    ch. 3. The pump draws a constant electric power, which counts as supplied; what is not work on the liquid is loss.
    """

    dp_max: Param[Scalar, "Pa", positive]  # pressure rise without flow
    q_max: Param[Scalar, "m3/s", positive]  # flow without pressure rise
    power: Param[Scalar, "W", positive]  # electric power

    def requirements(self) -> Requirements:
        # The largest work, 2/(3 sqrt(3)) dp_max q_max, is done at q_max/sqrt(3).
        most = 0.3849 * self.dp_max * self.q_max
        return (require(self.power >= most, "power must be at least 0.385 dp_max q_max, the largest work"),)

    def equations(self, d: Self) -> Equations:
        share = self.q / self.q_max
        return super().equations(d) | dict(curve=eq(self.dp, -self.dp_max * (1.0 - share * jnp.abs(share))))

    def energy(self) -> Energy:
        return Energy(dissipated=self.power + self.dp * self.q, supplied=self.power)


class FlowVolume(Resistance):
    """A volume of liquid in a line with a uniform temperature, that of `heat`, and with dp = resistance q.

    Inflow mixes at once with the whole volume, as in an ideal stirred tank (Levenspiel, `Chemical Reaction
    Engineering`, ch. 5), and the liquid is incompressible. A `Chamber` on the line is a dead end, through which nothing
    flows. With a heat source at `heat`, a `FlowVolume` is a boiler or a cooling jacket.
    """

    volume: Param[Scalar, "m3", positive]
    resistance: Param[Scalar, "Pa.s/m3", nonnegative] = 1e6  # pressure drop per flow

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(law=eq(self.dp, self.resistance * self.q))

    def held_liquid(self) -> Scalar:
        return self.volume


class Radiator(Resistance):
    """A radiator from a to b: Q = Q_nominal (dT/dT_nominal)^n to the room, with dT = (T_in + T)/2 - T_room (EN 442).

    T is the temperature of its liquid, at which it leaves; T_in that of the inflow. dp = resistance q. If the liquid
    does not carry heat, both are that of the port `heat`; without this port, it emits nothing.
    """

    Q_nominal: Param[Scalar, "W", positive]  # heat output at dT_nominal
    volume: Param[Scalar, "m3", positive]  # volume of liquid
    dT_nominal: Param[Scalar, "K", positive] = 50.0  # mean excess temperature of the data sheet
    n: Param[Scalar, "1", positive] = 1.3  # exponent
    resistance: Param[Scalar, "Pa.s/m3", nonnegative] = 1e6  # pressure drop per flow
    room: HeatPort = HeatPort()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            law=eq(self.dp, self.resistance * self.q),
            emission=eq(self.room.Q_flow, -self.drawn()),
        )

    def held_liquid(self) -> Scalar:
        return self.volume

    def drawn(self) -> Any:
        if self.heat is None:
            return 0.0
        share = (0.5 * (self._inlet(self.heat.T) + self.heat.T) - self.room.T) / self.dT_nominal
        # Rounded within a thousandth, so that the slope at zero is finite for n below 1, too.
        return self.Q_nominal * share * (share**2 + 1e-6) ** (0.5 * (self.n - 1.0))


class ThermostaticValve(Resistance):
    """A valve from a to b that a temperature closes: q = (x + leakage) K sqrt(dp), K = rated_flow/sqrt(rated_drop).

    tau dx/dt = target - x with the target (T_closed - T)/band for a radiator valve, limited to 0 .. 1. With `sense=-1`
    it opens above T_closed, as the thermostat of an engine does: (T - T_closed)/band. `sensor` draws no heat; connect
    it to the room, or to the heat port of a part. Square root as in `Orifice`.
    """

    rated_flow: Param[Scalar, "m3/s", positive]  # flow of the fully open valve
    rated_drop: Param[Scalar, "Pa", positive]  # pressure drop at rated_flow
    T_closed: Param[Scalar, "K", positive]  # temperature at which it closes
    band: Param[Scalar, "K", positive] = 2.0  # temperature difference between closed and fully open
    tau: Param[Scalar, "s", positive] = 300.0  # time constant of the sensing element
    sense: Param[Scalar, "1", nonzero] = 1.0  # 1 if warmth closes the valve, -1 if it opens it
    leakage: Param[Scalar, "1", nonnegative] = 1e-3  # opening of the closed valve
    transition_pressure: Param[Scalar, "Pa", positive] = 100.0  # width of the transition at zero pressure drop
    x: Var[Scalar, "1", prefer] = 0.0  # opening
    sensor: HeatPort = HeatPort()

    def requirements(self) -> Requirements:
        return (require(jnp.abs(self.sense) == 1.0, "sense must be 1 or -1"),)

    def equations(self, d: Self) -> Equations:
        target = limited(self.sense * (self.T_closed - self.sensor.T) / self.band, 0.0, 1.0)
        conductance = (self.x + self.leakage) * self.rated_flow / jnp.sqrt(self.rated_drop)
        return super().equations(d) | dict(
            no_heat=eq(self.sensor.Q_flow),
            opening=eq(self.tau * d.x, target - self.x),
            law=eq(self.q, turbulent_flow(self.dp, conductance, self.transition_pressure)),
        )
