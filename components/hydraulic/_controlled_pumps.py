"""Variable pumps with displacement controllers."""

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
from ._spool_valves import PilotStage


class ControlledPump(LiquidPump, partial=True):
    """A pump with a displacement controller: tau dx/dt = target - x, 0 <= target <= 1."""

    tau: Param[Scalar, "s", positive]  # time constant of the swash plate
    x: Var[Scalar, "1", prefer] = 0.0  # displacement setting

    @abc.abstractmethod
    def target(self) -> Scalar:
        """Setpoint of x."""

    def share(self) -> Scalar:
        return self.x

    def equations(self, d: Any) -> Equations:
        return super().equations(d) | dict(swash=eq(self.tau * d.x, self.target() - self.x))


class CompensatedPump(ControlledPump, partial=True):
    """A pump that delivers less as its pressure approaches p_set."""

    p_set: Param[Scalar, "Pa", positive]  # pressure at zero displacement
    band: Param[Scalar, "Pa", positive]  # pressure difference between full and zero displacement

    def _compensated(self) -> Scalar:
        return limited(self._excess(), 0.0, 1.0)

    def _excess(self) -> Scalar:
        return (self.p_set - self.b.p) / self.band


class PressureCompensatedPump(CompensatedPump):
    """Full displacement up to p_set - band, zero at p_set: target = (p_set - p_b)/band, limited to 0 .. 1.

    See `LiquidPump` for the law, with the delivery at b; the swash plate follows by tau dx/dt = target - x.
    """

    def target(self) -> Scalar:
        return self._compensated()


class PowerLimitedPump(CompensatedPump):
    """A `PressureCompensatedPump` with a power limit: target <= power/(D w dp).

    Between the two limits it follows a hyperbola of constant power, q dp = power without losses. The swash plate lags,
    tau dx/dt = target - x, so a fast rise of the pressure exceeds the limit temporarily.
    """

    power: Param[Scalar, "W", positive]  # maximum power to the liquid, without the losses of the pump

    def target(self) -> Scalar:
        full, compensated = self._full_power(), self._compensated()
        is_much = full > self.power
        share = ifelse(is_much, self.power / jnp.where(is_much, full, self.power), 1.0)
        return ifelse(compensated < share, compensated, share)

    def _full_power(self) -> Scalar:
        return self.displacement * self.w * self.dp


class LoadSensingPump(ControlledPump):
    """A pump that keeps its delivery pressure a margin above the load pressure, with pressure compensation.

    The target is the lower of (p_load + margin - p_b)/band and (p_set - p_b)/band_set, limited to 0 .. 1. The port
    `load` only senses. See `LiquidPump` for the law; tau dx/dt = target - x.
    """

    margin: Param[Scalar, "Pa", positive]  # pressure above the load at zero displacement
    band: Param[Scalar, "Pa", positive]  # pressure difference between full and zero displacement
    p_set: Param[Scalar, "Pa", positive]  # pressure at zero displacement for any load
    band_set: Param[Scalar, "Pa", positive]  # band of the pressure compensation
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
    """A `VariablePump` whose swash plate follows the signal u through a `PilotStage`: second order, rate limited.

    `ServoPump(swash=PilotStage(w=60.0, D=0.8, rate=12.0), pump=VariablePump(...))`. The rate is the inverse of the
    data-sheet time from zero to full displacement.
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
