"""Valves that pressures open and close: each has an opening x that follows its balance of forces with a lag."""

import abc
from typing import Any, Self

import jax.numpy as jnp

from acausal import Equations, Param, Scalar, Var, eq, ifelse, nonnegative, positive, prefer

from .._limit import limited, positive_part
from ._interfaces import FluidPort
from ._valves import Resistance, turbulent_flow


class PilotedValve(Resistance, partial=True):
    """q = (x + leakage) K sqrt(dp), with K = rated_flow/sqrt(rated_drop) and tau dx/dt = target - x.

    The target is the excess over the setting, as a share of the `band`, limited to 0 .. 1. The root is rounded at zero
    as in `Orifice`. The lag stands for the mass and the damping of spool and pilot. Not modelled: flow forces.
    """

    rated_flow: Param[Scalar, "m3/s", positive]  # fully open
    rated_drop: Param[Scalar, "Pa", positive]  # at this pressure drop
    band: Param[Scalar, "Pa", positive]  # from closed to fully open
    tau: Param[Scalar, "s", positive] = 2e-3  # lag of the opening
    leakage: Param[Scalar, "1", nonnegative] = 0.0  # of the closed valve, as an opening
    transition_pressure: Param[Scalar, "Pa", positive] = 100.0  # width of the root at zero
    x: Var[Scalar, "1", prefer] = 0.0  # opening

    @abc.abstractmethod
    def excess(self) -> Scalar:
        """Pressure in Pa by which the setting is exceeded."""

    def equations(self, d: Any) -> Equations:
        conductance = (limited(self.x, 0.0, 1.0) + self.leakage) * self.rated_flow / jnp.sqrt(self.rated_drop)
        return super().equations(d) | dict(
            opening=eq(self.tau * d.x, limited(self.excess() / self.band, 0.0, 1.0) - self.x),
            law=eq(self.q, turbulent_flow(self.dp, conductance, self.transition_pressure)),
        )


class PilotReliefValve(PilotedValve):
    """Opens from a to b when the pressure drop exceeds `pressure`; a pilot makes the band narrow and the lag long.

    See `PilotedValve`; `ReliefValve` is the static one.
    """

    pressure: Param[Scalar, "Pa", nonnegative]  # at which it begins to open

    def excess(self) -> Scalar:
        return self.dp - self.pressure


class SequenceValve(PilotedValve):
    """Opens from a to b when the pressure at a exceeds `pressure`, whatever that at b: its drain is external.

    See `PilotedValve`.
    """

    pressure: Param[Scalar, "Pa", nonnegative]  # at which it begins to open

    def excess(self) -> Scalar:
        return self.a.p - self.pressure


class UnloadingValve(PilotedValve):
    """Opens from a to b when the pressure at the port `pilot`, which senses only, exceeds `pressure`: a pump idles.

    With a check valve between a and the pilot, the large one of two pumps goes to the tank while the small one presses.
    See `PilotedValve`; `SequenceValve` opens by the pressure at a.
    """

    pressure: Param[Scalar, "Pa", nonnegative]  # at which it begins to open
    pilot: FluidPort = FluidPort()

    def excess(self) -> Scalar:
        return self.pilot.p - self.pressure

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(senses=eq(self.pilot.q))


class PressureReducingValve(PilotedValve):
    """Keeps the pressure at b below `pressure`: open at pressure - band and less, closed at `pressure`.

    See `PilotedValve`. It does not relieve b when that is pressed from outside.
    """

    pressure: Param[Scalar, "Pa", positive]  # at which it is closed

    def excess(self) -> Scalar:
        return self.pressure - self.b.p


class CounterbalanceValve(PilotedValve):
    """Holds a load at a until p_a + ratio p_x exceeds `pressure`; x is the pilot, the other side of the cylinder.

    From b to a the load is raised through a check valve: put a `CheckValve` in parallel. See `PilotedValve`.
    """

    pressure: Param[Scalar, "Pa", positive]  # at which the load alone begins to open it
    ratio: Param[Scalar, "1", nonnegative]  # of the pilot's area to that of the load
    pilot: FluidPort = FluidPort()

    def excess(self) -> Scalar:
        return self.a.p + self.ratio * self.pilot.p - self.pressure

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(senses=eq(self.pilot.q))


class PilotCheckValve(PilotedValve):
    """Lets liquid pass from a to b, and back once the pilot opens it: p_a - p_b + ratio (p_x - p_a)+ > cracking.

    ( )+ is 0 below zero: the pilot's piston pushes the poppet, and does not hold it. See `PilotedValve`.
    """

    cracking: Param[Scalar, "Pa", nonnegative]  # pressure of its spring
    ratio: Param[Scalar, "1", nonnegative]  # of the pilot piston's area to that of the seat
    pilot: FluidPort = FluidPort()

    def excess(self) -> Scalar:
        push = self.pilot.p - self.a.p
        return self.dp + self.ratio * positive_part(push) - self.cracking

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(senses=eq(self.pilot.q))


class BypassCompensator(PilotedValve):
    """Lets the surplus of a fixed pump at a pass to b, so that p_a stays `margin` above the pressure of the load.

    With a metering edge between a and the load it makes the flow to the load one of the edge alone: load sensing with
    a fixed pump, or a three-way flow regulator. The port `load` senses only. See `PilotedValve`.
    """

    margin: Param[Scalar, "Pa", positive]  # above the load, at which it begins to open
    load: FluidPort = FluidPort()

    def excess(self) -> Scalar:
        return self.a.p - self.load.p - self.margin

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(senses=eq(self.load.q))


class FlowControlValve(Resistance):
    """A throttle behind a pressure compensator: from a to b the flow is `flow`, once dp is above `margin`.

    Below the margin and backward it is an orifice, q = flow sqrt(dp/margin), rounded at zero as in `Orifice`. The
    compensator acts at once.
    """

    flow: Param[Scalar, "m3/s", nonnegative]  # set
    margin: Param[Scalar, "Pa", positive] = 8e5  # pressure drop that the compensator needs
    transition_pressure: Param[Scalar, "Pa", positive] = 100.0  # width of the root at zero

    def equations(self, d: Self) -> Equations:
        dp = ifelse(self.dp < self.margin, self.dp, self.margin)
        law = turbulent_flow(dp, self.flow / jnp.sqrt(self.margin), self.transition_pressure)
        return super().equations(d) | dict(law=eq(self.q, law))
