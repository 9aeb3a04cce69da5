"""Pressure-controlled valves: an opening x follows the balance of forces with a lag."""

import abc
from collections.abc import Mapping
from typing import Any, ClassVar, Self

import jax.numpy as jnp

from acausal import (
    Discrete,
    Equations,
    Events,
    Param,
    Requirements,
    Scalar,
    Var,
    eq,
    ifelse,
    nonnegative,
    positive,
    prefer,
    require,
    when,
)

from .._limit import limited, positive_part
from ._interfaces import FluidPort
from ._valves import Resistance, turbulent_flow


class LaggingValve(Resistance, partial=True):
    """q = (x + leakage) K sqrt(dp), with K = rated_flow/sqrt(rated_drop) and tau dx/dt = target - x.

    The square root is smoothed at zero as in `Orifice`. The lag represents mass and damping of spool and pilot. Not
    modelled: flow forces.
    """

    rated_flow: Param[Scalar, "m3/s", positive]  # flow of the fully open valve
    rated_drop: Param[Scalar, "Pa", positive]  # pressure drop at rated_flow
    tau: Param[Scalar, "s", positive] = 2e-3  # time constant of the opening
    leakage: Param[Scalar, "1", nonnegative] = 0.0  # opening of the closed valve
    transition_pressure: Param[Scalar, "Pa", positive] = 100.0  # width of the transition at zero pressure drop
    x: Var[Scalar, "1", prefer] = 0.0  # opening

    @abc.abstractmethod
    def target(self) -> Scalar:
        """The opening that x follows, 0 .. 1."""

    def equations(self, d: Any) -> Equations:
        conductance = (limited(self.x, 0.0, 1.0) + self.leakage) * self.rated_flow / jnp.sqrt(self.rated_drop)
        return super().equations(d) | dict(
            opening=eq(self.tau * d.x, self.target() - self.x),
            law=eq(self.q, turbulent_flow(self.dp, conductance, self.transition_pressure)),
        )


class ExternallyPilotedValve(LaggingValve, partial=True):
    """A `LaggingValve` with a port that senses the pressure of another line, without flow."""

    pilot: FluidPort = FluidPort()

    def equations(self, d: Any) -> Equations:
        return super().equations(d) | dict(senses=eq(self.pilot.q))


class PilotedValve(LaggingValve, partial=True):
    """A `LaggingValve` that opens in proportion to a pressure in excess of its setting.

    The target of its opening is the excess as a fraction of `band`, limited to 0 .. 1.
    """

    band: Param[Scalar, "Pa", positive]  # pressure difference between closed and fully open

    @abc.abstractmethod
    def excess(self) -> Scalar:
        """Pressure in excess of the setting in Pa."""

    def target(self) -> Scalar:
        return limited(self.excess() / self.band, 0.0, 1.0)


class PilotReliefValve(PilotedValve):
    """A pilot-operated relief valve: opens from a to b if the pressure drop exceeds `pressure`.

    The pilot stage makes the band narrow and the lag long. See `PilotedValve`; `ReliefValve` is the static counterpart.
    """

    pressure: Param[Scalar, "Pa", nonnegative]  # pressure drop at which it begins to open

    def excess(self) -> Scalar:
        return self.dp - self.pressure


class SequenceValve(PilotedValve):
    """Opens from a to b if the pressure at a exceeds `pressure`, independently of b: the drain is external.

    See `PilotedValve`.
    """

    pressure: Param[Scalar, "Pa", nonnegative]  # pressure at a at which it begins to open

    def excess(self) -> Scalar:
        return self.a.p - self.pressure


class UnloadingValve(ExternallyPilotedValve, PilotedValve):
    """Opens from a to b, to unload a pump, if the pressure at the sensing port `pilot` exceeds `pressure`.

    With a check valve from a to the pilot, the larger of two pumps is unloaded to the tank while the smaller one holds
    the pressure. See `PilotedValve`; `SequenceValve` opens by the pressure at a.
    """

    pressure: Param[Scalar, "Pa", nonnegative]  # pressure at the pilot at which it begins to open

    def excess(self) -> Scalar:
        return self.pilot.p - self.pressure


class ChargingValve(ExternallyPilotedValve):
    """Unloads a pump from a to b once an accumulator at the sensing port `pilot` is full, until it must be charged.

    It opens fully if the pressure at the pilot exceeds `high`, and closes if it falls below `low`; both are events.
    Put a check valve from a to the accumulator. See `LaggingValve`; `UnloadingValve` opens in proportion instead.
    """

    low: Param[Scalar, "Pa", nonnegative]  # cut-in pressure, below which it closes and the pump charges
    high: Param[Scalar, "Pa", positive]  # cut-out pressure, above which it opens
    is_open: Discrete[Scalar, "1"] = 0.0  # 1: the pump is unloaded
    mode_names: ClassVar[Mapping[str, Mapping[float, str]]] = {"is_open": {0.0: "charges", 1.0: "unloads"}}

    def requirements(self) -> Requirements:
        return (require(self.low < self.high, "low must be smaller than high"),)

    def target(self) -> Scalar:
        return self.is_open

    def events(self) -> Events:
        is_open = self.is_open > 0.5
        return dict(
            unloads=when(~is_open & (self.pilot.p > self.high), is_open=1.0),
            charges=when(is_open & (self.pilot.p < self.low), is_open=0.0),
        )


class PressureReducingValve(PilotedValve):
    """Keeps the pressure at b below `pressure`: fully open up to pressure - band, closed at `pressure`.

    See `PilotedValve`. It does not relieve b if the pressure there is raised from outside.
    """

    pressure: Param[Scalar, "Pa", positive]  # pressure at b at which it is closed

    def excess(self) -> Scalar:
        return self.pressure - self.b.p


class CounterbalanceValve(ExternallyPilotedValve, PilotedValve):
    """Holds a load at a until p_a + ratio p_x exceeds `pressure`; x is the pilot, from the other side of the cylinder.

    To raise the load, put a `CheckValve` from b to a in parallel. See `PilotedValve`.
    """

    pressure: Param[Scalar, "Pa", positive]  # load pressure at which it begins to open without pilot pressure
    ratio: Param[Scalar, "1", nonnegative]  # pilot area over the area on which the load pressure acts

    def excess(self) -> Scalar:
        return self.a.p + self.ratio * self.pilot.p - self.pressure


class PilotCheckValve(ExternallyPilotedValve, PilotedValve):
    """A pilot-operated check valve, open from a to b, and both ways if p_a - p_b + ratio (p_x - p_a)+ > cracking.

    ( )+ is 0 below zero, because the pilot piston can only push the poppet. See `PilotedValve`.
    """

    cracking: Param[Scalar, "Pa", nonnegative]  # cracking pressure of the spring
    ratio: Param[Scalar, "1", nonnegative]  # pilot piston area over seat area

    def excess(self) -> Scalar:
        push = self.pilot.p - self.a.p
        return self.dp + self.ratio * positive_part(push) - self.cracking


class BypassCompensator(PilotedValve):
    """Bypasses the surplus flow of a fixed pump from a to b, so that p_a stays `margin` above the load pressure.

    With a metering edge between a and the load, the flow to the load depends on the edge alone: load sensing with a
    fixed pump, or a three-way flow regulator. The port `load` only senses. See `PilotedValve`.
    """

    margin: Param[Scalar, "Pa", positive]  # pressure above the load at which it begins to open
    load: FluidPort = FluidPort()

    def excess(self) -> Scalar:
        return self.a.p - self.load.p - self.margin

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(senses=eq(self.load.q))


class FlowControlValve(Resistance):
    """A throttle with pressure compensator: the flow from a to b is `flow` as soon as dp exceeds `margin`.

    Below the margin, and from b to a, it is an orifice, q = flow sqrt(dp/margin), smoothed at zero as in `Orifice`. The
    compensator acts instantly.
    """

    flow: Param[Scalar, "m3/s", nonnegative]  # flow setting
    margin: Param[Scalar, "Pa", positive] = 8e5  # pressure drop that the compensator needs
    transition_pressure: Param[Scalar, "Pa", positive] = 100.0  # width of the transition at zero pressure drop

    def equations(self, d: Self) -> Equations:
        dp = ifelse(self.dp < self.margin, self.dp, self.margin)
        law = turbulent_flow(dp, self.flow / jnp.sqrt(self.margin), self.transition_pressure)
        return super().equations(d) | dict(law=eq(self.q, law))
