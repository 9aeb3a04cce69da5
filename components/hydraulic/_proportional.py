"""Valves with spool dynamics."""

from typing import Self

from acausal import Component, Connections, Equations, Param, Scalar, Var, connect, eq, positive, prefer

from .._limit import limited
from ..blocks import SISO, Input, Play, SecondOrder
from ._interfaces import FluidPort
from ._spool_valves import FourWayValve


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
