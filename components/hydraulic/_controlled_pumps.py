"""Variable pumps with the controllers that set their displacement."""

import abc
from typing import Any, Self

import jax.numpy as jnp

from acausal import (
    Component,
    Connections,
    Equations,
    Param,
    Scalar,
    Var,
    connect,
    eq,
    ifelse,
    positive,
    prefer,
)

from .._limit import limited
from ..blocks import Input
from ..rotational import Flange
from ._interfaces import FluidPort
from ._liquid_pumps import LiquidPump, VariablePump
from ._proportional import PilotStage


class ControlledPump(LiquidPump, partial=True):
    """A pump that sets its own displacement: tau dx/dt = target - x, 0 <= target <= 1."""

    tau: Param[Scalar, "s", positive]  # time constant of the swash plate
    x: Var[Scalar, "1", prefer] = 0.0  # share of the displacement

    @abc.abstractmethod
    def target(self) -> Scalar:
        """Where the controller wants x."""

    def share(self) -> Scalar:
        return self.x

    def equations(self, d: Any) -> Equations:
        return super().equations(d) | dict(swash=eq(self.tau * d.x, self.target() - self.x))


class CompensatedPump(ControlledPump, partial=True):
    """A pump that delivers less as its pressure comes near p_set."""

    p_set: Param[Scalar, "Pa", positive]  # pressure at which it delivers no more
    band: Param[Scalar, "Pa", positive]  # from full to no displacement

    def _compensated(self) -> Scalar:
        return limited(self._excess(), 0.0, 1.0)

    def _excess(self) -> Scalar:
        return (self.p_set - self.b.p) / self.band


class PressureCompensatedPump(CompensatedPump):
    """Full displacement up to p_set - band, and none at p_set: target = (p_set - p_b)/band, limited to 0 .. 1.

    See `LiquidPump` for the law, with the delivery at b; the swash plate follows by tau dx/dt = target - x.
    """

    def target(self) -> Scalar:
        return self._compensated()


class PowerLimitedPump(CompensatedPump):
    """A `PressureCompensatedPump` that takes no more than a power from its drive: target <= power/(D w dp).

    Between both limits it delivers along a hyperbola of constant power, q dp = power but for losses: a power-matched
    supply. tau dx/dt = target - x, so that a fast rise of the pressure exceeds it for a while.
    """

    power: Param[Scalar, "W", positive]  # to the liquid, losses of the pump excluded

    def target(self) -> Scalar:
        full, compensated = self._full_power(), self._compensated()
        is_much = full > self.power
        share = ifelse(is_much, self.power / jnp.where(is_much, full, self.power), 1.0)
        return ifelse(compensated < share, compensated, share)

    def _full_power(self) -> Scalar:
        return self.displacement * self.w * self.dp


class LoadSensingPump(ControlledPump):
    """Keeps its delivery a margin above the pressure of the load: the lower one of two targets, limited to 0 .. 1.

    (p_load + margin - p_b)/band and, as pressure compensation, (p_set - p_b)/band_set. The port `load` senses only.
    See `LiquidPump` for the law; tau dx/dt = target - x.
    """

    margin: Param[Scalar, "Pa", positive]  # above the load, at no displacement
    band: Param[Scalar, "Pa", positive]  # from full to no displacement
    p_set: Param[Scalar, "Pa", positive]  # pressure at which it delivers no more, whatever the load
    band_set: Param[Scalar, "Pa", positive]
    load: FluidPort = FluidPort()

    def target(self) -> Scalar:
        sensed, most = self._excesses()
        return limited(ifelse(sensed < most, sensed, most), 0.0, 1.0)

    def _excesses(self) -> tuple[Scalar, Scalar]:
        sensed = (self.load.p + self.margin - self.b.p) / self.band
        return sensed, (self.p_set - self.b.p) / self.band_set

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(senses=eq(self.load.q))


class ServoPump(Component):
    """A `VariablePump` whose swash plate follows the signal u by a `PilotStage`: second order, of limited speed.

    `ServoPump(swash=PilotStage(w=60.0, D=0.8, rate=12.0), pump=VariablePump(...))`, with the rate from the time that
    the data sheet gives for the way from no to full displacement.
    """

    swash: PilotStage
    pump: VariablePump
    u: Input = Input()
    shaft: Flange = Flange()
    a: FluidPort = FluidPort()  # suction
    b: FluidPort = FluidPort()  # delivery

    def connections(self) -> Connections:
        return (
            connect(self.u, self.swash.u),
            connect(self.swash.y, self.pump.u),
            connect(self.shaft, self.pump.shaft),
            connect(self.a, self.pump.a),
            connect(self.b, self.pump.b),
        )
