"""Valves with the dynamics of their spools."""

from typing import Self

from acausal import Component, Connections, Equations, Param, Scalar, Var, connect, eq, positive, prefer

from .._limit import limited
from ..blocks import SISO, Input, Play, SecondOrder
from ._interfaces import FluidPort
from ._spool_valves import FourWayValve


class DrivenValve(Component, partial=True):
    """A `FourWayValve` with something between the signal u and its spool."""

    valve: FourWayValve
    u: Input = Input()
    p: FluidPort = FluidPort()
    t: FluidPort = FluidPort()
    a: FluidPort = FluidPort()
    b: FluidPort = FluidPort()

    def connections(self) -> Connections:
        return tuple(connect(getattr(self, port), getattr(self.valve, port)) for port in "ptab")


class ProportionalValve(DrivenValve):
    """A `FourWayValve` whose spool follows its signal u as a second-order lag; servo valves alike.

    `ProportionalValve(spool=SecondOrder(w=2 pi 50, D=0.8), valve=FourWayValve(...))`, with the corner frequency of the
    data sheet for small signals. `ServoValve` has a limit of the spool's speed, and hysteresis.
    """

    spool: SecondOrder

    def connections(self) -> Connections:
        signals = (connect(self.u, self.spool.u), connect(self.spool.y, self.valve.u))
        return (*super().connections(), *signals)


class PilotStage(SISO):
    """How the first stage of a servo valve, or the controller of a swash plate, moves the second one to the signal u.

    With the share z that the first stage is open and the position x: dx/dt = rate z, and
    z follows w (u - x)/(2 D rate), limited to -1 .. 1, with a lag of 1/(2 D w). For small signals this is
    d2x/dt2 + 2 D w dx/dt + w^2 x = w^2 u; for large ones x moves with the speed that the flow of the first stage
    allows (Merritt, `Hydraulic Control Systems`, ch. 7). u is limited to -1 .. 1.
    """

    w: Param[Scalar, "rad/s", positive]  # corner frequency for small signals
    D: Param[Scalar, "1", positive]  # damping ratio
    rate: Param[Scalar, "1/s", positive]  # highest speed, in strokes from the middle to an end per second
    x: Var[Scalar, "1", prefer] = 0.0  # position; its start value
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
    """A two-stage servo valve: a `FourWayValve` whose spool a `PilotStage` moves, behind the hysteresis of its motor.

    `ServoValve(play=Play(width=0.02), stage=PilotStage(w=2 pi 100, D=0.8, rate=100.0), valve=FourWayValve(...))`, with
    hysteresis, corner frequency and time of a full stroke, 1/rate, of the data sheet.
    """

    play: Play
    stage: PilotStage

    def connections(self) -> Connections:
        signals = (
            connect(self.u, self.play.u), connect(self.play.y, self.stage.u), connect(self.stage.y, self.valve.u),
        )  # fmt: skip
        return (*super().connections(), *signals)
