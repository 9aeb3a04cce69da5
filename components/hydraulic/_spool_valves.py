"""Directional spool valves with metering edges, also with open centre or with spool dynamics."""

import abc
from typing import Any, Self

import jax.numpy as jnp

from acausal import (
    ArgumentError,
    Component,
    Connections,
    Energy,
    Equations,
    Param,
    Requirements,
    Scalar,
    Var,
    connect,
    eq,
    nonnegative,
    positive,
    prefer,
    require,
)

from .._limit import absolute, limited, positive_part
from ..blocks import SISO, Input, Play, SecondOrder
from ._heat_carrier import HeatCarrier, with_carrier
from ._interfaces import FluidPort, MixedPart
from ._valves import turbulent_flow


class Spool(MixedPart, partial=True):
    """A spool at u, from -1 to 1, with metering edges q = (K y + K_leak) sqrt(dp), smoothed at zero as in `Orifice`.

    The opening of an edge is y = (+-u - lap)/(1 - lap), limited to 0 .. 1: closed in the middle position with a
    positive lap, open with a negative lap. K = rated_flow/sqrt(rated_drop) for one edge at full stroke, as stated in
    data sheets. With `heat=HeatPort()` the losses of the edges leave as heat.
    """

    rated_flow: Param[Scalar, "m3/s", positive]  # flow through one fully open edge
    rated_drop: Param[Scalar, "Pa", positive]  # pressure drop at rated_flow
    lap: Param[Scalar, "1"] = 0.0  # lap of the edges to the supply, relative to the stroke; below 1
    lap_return: Param[Scalar, "1"] = 0.0  # lap of the edges to the tank
    leakage: Param[Scalar, "1", nonnegative] = 0.0  # K_leak/K
    transition_pressure: Param[Scalar, "Pa", positive] = 100.0  # width of the transition at zero pressure drop
    u: Input = Input()

    @abc.abstractmethod
    def _loss(self) -> Scalar:
        """Power dissipated at the edges in W."""

    def equations(self, d: Any) -> Equations:
        del d
        return {}

    def energy(self) -> Energy:
        return Energy(dissipated=self._loss())

    def requirements(self) -> Requirements:
        return (
            require(self.lap < 1.0, "lap must be below 1"),
            require(self.lap_return < 1.0, "lap_return must be below 1"),
        )

    def _position(self) -> Scalar:
        """Position of the spool, -1 .. 1."""
        return self.u.value

    def _opening(self, sense: float, lap: Scalar) -> Scalar:
        return (sense * self._position() - lap) / (1.0 - lap)

    def _edge(self, dp: Scalar, opening: Scalar) -> Scalar:
        return self._flow(dp, limited(opening, 0.0, 1.0) + self.leakage)

    def _flow(self, dp: Scalar, share: Scalar) -> Scalar:
        conductance = self.rated_flow / jnp.sqrt(self.rated_drop) * share
        return turbulent_flow(dp, conductance, self.transition_pressure)


class TwoEdges(Spool, partial=True):
    """Two edges: a position above 0 connects p to a, one below 0 connects a to t."""

    q_pa: Var[Scalar, "m3/s"] = 0.0  # flow from p to a
    q_at: Var[Scalar, "m3/s"] = 0.0  # flow from a to t
    p: FluidPort = FluidPort()
    t: FluidPort = FluidPort()
    a: FluidPort = FluidPort()

    def equations(self, d: Any) -> Equations:
        supply, drain = self._opening(1.0, self.lap), self._opening(-1.0, self.lap_return)
        return super().equations(d) | dict(
            edge_pa=eq(self.q_pa, self._edge(self.p.p - self.a.p, supply)),
            edge_at=eq(self.q_at, self._edge(self.a.p - self.t.p, drain)),
            flow_p=eq(self.p.q, self.q_pa),
            flow_t=eq(self.t.q, -self.q_at),
            flow_a=eq(self.a.q, self.q_at - self.q_pa),
        )

    def _loss(self) -> Scalar:
        return (self.p.p - self.a.p) * self.q_pa + (self.a.p - self.t.p) * self.q_at


class ThreeWayValve(TwoEdges):
    """3/2 or proportional 3/3 valve: u > 0 connects p to a, u < 0 connects a to t."""


class ProportionalReducingValve(TwoEdges):
    """A proportional pressure-reducing and relieving valve, as for a clutch: u sets the pressure at a.

    The force of the solenoid acts on the spool against the pressure at a, which is fed back to its end face. With the
    position x of the spool, of which x > 0 connects p to a and x < 0 connects a to t,

    p_set = pressure (u - dead_band)/(1 - dead_band), limited to 0 .. pressure,
    d2x/dt2 + 2 D w dx/dt + w^2 x = w^2 (p_set - p_a)/band, limited to -w^2 .. w^2.

    Static figures from the data sheet: `pressure` at full command, the dead band of the characteristic, and the flow of
    an open edge. `band` is the change of pressure between no flow and an open edge, the slope of the characteristic
    over flow. `w` and `D` follow from the step response without flow. See `Spool` for the edges: with positive laps,
    both are closed around the set pressure. With a capacity C behind the valve, in m3/Pa, the pressure is stable if
    K sqrt(dp)/(C band) < 2 D w, where K sqrt(dp) is the flow of an open edge; otherwise it oscillates, as a real valve
    does. This is Routh's condition for the linear loop of spool and capacity. Not modelled: flow forces.
    """

    pressure: Param[Scalar, "Pa", positive]  # pressure at a at full command, u = 1
    band: Param[Scalar, "Pa", positive]  # error of the pressure at which an edge is fully open
    dead_band: Param[Scalar, "1", nonnegative] = 0.0  # command up to which the set pressure is zero; below 1
    w: Param[Scalar, "rad/s", positive] = 400.0  # corner frequency of the spool
    D: Param[Scalar, "1", positive] = 0.8  # damping ratio of the spool
    x: Var[Scalar, "1", prefer] = 0.0  # position of the spool, relative to its stroke
    v: Var[Scalar, "1/s", prefer] = 0.0  # its speed

    def requirements(self) -> Requirements:
        return (*super().requirements(), require(self.dead_band < 1.0, "dead_band must be below 1"))

    def _position(self) -> Scalar:
        return self.x

    def _set_pressure(self) -> Scalar:
        return self.pressure * limited((self.u.value - self.dead_band) / (1.0 - self.dead_band), 0.0, 1.0)

    def equations(self, d: Self) -> Equations:
        target = limited((self._set_pressure() - self.a.p) / self.band, -1.0, 1.0)
        return super().equations(d) | dict(
            speed=eq(d.x, self.v),
            balance=eq(d.v, self.w**2 * (target - self.x) - 2.0 * self.D * self.w * self.v),
        )


class FourEdges(Spool, partial=True):
    """Four edges: u > 0 connects p to a and b to t, u < 0 p to b and a to t."""

    q_pa: Var[Scalar, "m3/s"] = 0.0  # flow from p to a, and so on
    q_pb: Var[Scalar, "m3/s"] = 0.0
    q_at: Var[Scalar, "m3/s"] = 0.0
    q_bt: Var[Scalar, "m3/s"] = 0.0
    p: FluidPort = FluidPort()
    t: FluidPort = FluidPort()
    a: FluidPort = FluidPort()
    b: FluidPort = FluidPort()

    def _edges(self) -> dict[str, tuple[Any, Any, Any]]:
        """Flow, pressure drop and opening of each edge."""
        p, t, a, b = self.p.p, self.t.p, self.a.p, self.b.p
        to_a, to_b = self._opening(1.0, self.lap), self._opening(-1.0, self.lap)
        from_a, from_b = self._opening(-1.0, self.lap_return), self._opening(1.0, self.lap_return)
        return dict(
            pa=(self.q_pa, p - a, to_a),
            pb=(self.q_pb, p - b, to_b),
            at=(self.q_at, a - t, from_a),
            bt=(self.q_bt, b - t, from_b),
        )

    def _paths(self) -> dict[str, tuple[Any, Any]]:
        """Flow and pressure drop of each path, by its two ports."""
        return {name: (q, dp) for name, (q, dp, _) in self._edges().items()}

    def carrying(self, carrier: HeatCarrier) -> Self:
        if self.heat is not None:
            raise ArgumentError(f"{type(self).__name__}: liquids that carry heat take the losses along. Omit `heat`.")
        return with_carrier(self, carrier)

    def shared_equations(self, d: Any) -> Equations:
        """The liquid of each path flows from node to node, and takes its loss along."""
        if self.carrier is None:
            return super().shared_equations(d)
        ports = dict(self.thermal_ports())
        into: dict[str, Any] = dict.fromkeys(ports, 0.0)
        for (start, end), (q, dp) in self._paths().items():
            carried, is_forward = self.carrier.flow(q, ports[start].T, ports[end].T), q > 0.0
            into[start] += carried - jnp.where(is_forward, 0.0, dp * q)
            into[end] -= carried + jnp.where(is_forward, dp * q, 0.0)
        return {f"heat_{name}": eq(port.H_flow, into[name]) for name, port in ports.items()}

    def shared_energy(self, own: Energy) -> Energy:
        return super().shared_energy(own) if self.carrier is None else own._replace(dissipated=0.0)

    def equations(self, d: Any) -> Equations:
        laws = {f"edge_{name}": eq(q, self._edge(dp, opening)) for name, (q, dp, opening) in self._edges().items()}
        return (
            super().equations(d)
            | laws
            | dict(
                flow_p=eq(self.p.q, self.q_pa + self.q_pb),
                flow_t=eq(self.t.q, -self.q_at - self.q_bt),
                flow_a=eq(self.a.q, self.q_at - self.q_pa),
                flow_b=eq(self.b.q, self.q_bt - self.q_pb),
            )
        )

    def _loss(self) -> Scalar:
        return sum(dp * q for q, dp in self._paths().values())


class FourWayValve(FourEdges):
    """4/3 or proportional valve: u > 0 connects p to a and b to t, u < 0 p to b and a to t.

    With a signal of either -1 or 1 it is a 4/2 valve. For spool dynamics, put a block such as `blocks.SecondOrder` in
    front of u; see `ProportionalValve`. `FourWaySpool` includes the flow forces on the spool.
    """


class SixWayValve(FourEdges):
    """6/3 valve with an open centre: the edges of a `FourWayValve`, and a bypass from c to d that closes as they open.

    The bypass flow is K_c x sqrt(dp) with x = 1 - |u|/closed, at least 0, and K_c = bypass_flow/sqrt(rated_drop). In
    the middle position, the pump flow passes at low pressure to the next valve or to the tank. See `Spool`.
    """

    bypass_flow: Param[Scalar, "m3/s", positive]  # flow through the open bypass at rated_drop
    closed: Param[Scalar, "1", positive] = 0.6  # |u| above which the bypass is closed
    q_cd: Var[Scalar, "m3/s"] = 0.0  # flow from c to d
    c: FluidPort = FluidPort()
    d: FluidPort = FluidPort()

    def equations(self, d: Self) -> Equations:
        share = self.bypass_flow / self.rated_flow * self._bypass()
        return super().equations(d) | dict(
            edge_cd=eq(self.q_cd, self._flow(self.c.p - self.d.p, share)),
            flow_c=eq(self.c.q, self.q_cd),
            flow_d=eq(self.d.q, -self.q_cd),
        )

    def _paths(self) -> dict[str, tuple[Any, Any]]:
        return super()._paths() | dict(cd=(self.q_cd, self.c.p - self.d.p))

    def _bypass(self) -> Scalar:
        return positive_part(1.0 - absolute(self.u.value / self.closed))


class DrivenValve(Component, partial=True):
    """Base class of `FourWayValve`s with a stage between the signal u and the spool."""

    valve: FourWayValve
    u: Input = Input()
    p: FluidPort = FluidPort()
    t: FluidPort = FluidPort()
    a: FluidPort = FluidPort()
    b: FluidPort = FluidPort()

    def connections(self) -> Connections:
        return tuple(connect(getattr(self, port), getattr(self.valve, port)) for port in "ptab")


class ProportionalValve(DrivenValve):
    """A proportional or servo valve: a `FourWayValve` whose spool follows its signal u as a second-order lag.

    `ProportionalValve(spool=SecondOrder(w=2 pi 50, D=0.8), valve=FourWayValve(...))`, with the small-signal corner
    frequency of the data sheet. `ServoValve` also limits the spool speed and has hysteresis.
    """

    spool: SecondOrder

    def connections(self) -> Connections:
        signals = (connect(self.u, self.spool.u), connect(self.spool.y, self.valve.u))
        return (*super().connections(), *signals)


class PilotStage(SISO):
    """The first stage of a servo valve or swash plate controller, which moves the second stage to the signal u.

    With the opening z of the first stage and the position x: dx/dt = rate z, and
    z follows w (u - x)/(2 D rate), limited to -1 .. 1, with a lag of 1/(2 D w). For small signals this is
    d2x/dt2 + 2 D w dx/dt + w^2 x = w^2 u; for large signals, the flow of the first stage limits the speed of x
    (Merritt, `Hydraulic Control Systems`, ch. 7). u is limited to -1 .. 1.
    """

    w: Param[Scalar, "rad/s", positive]  # corner frequency for small signals
    D: Param[Scalar, "1", positive]  # damping ratio
    rate: Param[Scalar, "1/s", positive]  # maximum speed, in strokes from the middle to an end per second
    x: Var[Scalar, "1", prefer] = 0.0  # position
    z: Var[Scalar, "1", prefer] = 0.0  # opening of the first stage

    def equations(self, d: Self) -> Equations:
        return dict(
            first=eq(d.z, 2.0 * self.D * self.w * (limited(self._error(), -1.0, 1.0) - self.z)),
            second=eq(d.x, self.rate * self.z),
            output=eq(self.y.value, self.x),
        )

    def _error(self) -> Scalar:
        return self.w / (2.0 * self.D * self.rate) * (limited(self.u.value, -1.0, 1.0) - self.x)


class ServoValve(DrivenValve):
    """A two-stage servo valve: hysteresis of the torque motor, `PilotStage` and `FourWayValve`.

    `ServoValve(play=Play(width=0.02), stage=PilotStage(w=2 pi 100, D=0.8, rate=100.0), valve=FourWayValve(...))`, with
    the hysteresis, corner frequency and full-stroke time 1/rate of the data sheet.
    """

    play: Play
    stage: PilotStage

    def connections(self) -> Connections:
        signals = (
            connect(self.u, self.play.u), connect(self.play.y, self.stage.u), connect(self.stage.y, self.valve.u),
        )  # fmt: skip
        return (*super().connections(), *signals)
