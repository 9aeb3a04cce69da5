"""Pumps and motors that know their liquid: losses by its viscosity, delivery by its density at the inlet."""

import abc
from typing import Any, Self

import jax.numpy as jnp

from acausal import (
    Component,
    Energy,
    Equations,
    Events,
    Param,
    Scalar,
    Var,
    eq,
    kink,
    nonnegative,
    positive,
    prefer,
)

from .._limit import limited
from ..blocks import Input
from ..rotational import Flange
from ._interfaces import FluidPort
from ._liquids import AnyLiquid
from ._pump_losses import PumpLosses


class LiquidPump(Component, partial=True):
    """A displacement machine: with dp = p_b - p_a, the share x of its displacement D and the density r at its inlet,

    q = x D w r - slip from a to b, and J dw/dt = tau - x D r dp - drag; slip and drag as the losses say. At the inlet,
    which is a while x w > 0 and else b, a liquid that is torn apart fills the chambers less: as the pressure there
    falls to that of the vapour, the delivery fades. Not modelled: ripple, compression in the pump, a drain of its own.
    """

    displacement: Param[Scalar, "m3/rad", positive]  # D; 1 cm3/rev is 1e-6/(2 pi) m3/rad
    liquid: AnyLiquid
    losses: PumpLosses
    J: Param[Scalar, "kg.m2", nonnegative] = 0.0  # moment of inertia
    w: Var[Scalar, "rad/s", prefer] = 0.0  # speed
    dp: Var[Scalar, "Pa"] = 0.0  # pressure rise from a to b
    q: Var[Scalar, "m3/s"] = 0.0  # flow from a to b
    shaft: Flange = Flange()
    a: FluidPort = FluidPort()  # suction
    b: FluidPort = FluidPort()  # delivery

    @abc.abstractmethod
    def share(self) -> Scalar:
        """x, the part of the displacement that is set; negative where it delivers backward."""

    def equations(self, d: Any) -> Equations:
        filled = self.displacement * self.share() * self._filling()
        return dict(
            speed=eq(self.w, d.shaft.phi),
            rise=eq(self.dp, self.b.p - self.a.p),
            suction=eq(self.a.q, self.q),
            delivery=eq(self.b.q, -self.q),
            flow=eq(self.q, filled * self.w - self._slip()),
            newton=eq(self.J * d.w, self.shaft.tau - filled * self.dp - self._drag()),
        )

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.J * self.w**2, dissipated=self._slip() * self.dp + self._drag() * self.w)

    def _filling(self) -> Scalar:
        forward = self.share() * self.w >= 0.0
        return self.liquid.relative_density(jnp.where(forward, self.a.p, self.b.p))

    def _viscosity(self) -> Scalar:
        return self.liquid.reference_density * self.liquid.kinematic_viscosity(0.5 * (self.a.p + self.b.p))

    def _slip(self) -> Scalar:
        return self.losses.slip(self.displacement, self.dp, self._viscosity(), self.liquid.reference_density)

    def _drag(self) -> Scalar:
        return self.losses.drag(self.displacement, self.dp, self.w, self._viscosity(), self.liquid.reference_density)


class FixedPump(LiquidPump):
    """Pump or motor of fixed displacement with the losses of Wilson or Schloesser. See `LiquidPump` for the law.

    `Pump` is the one for a constant density, with constant coefficients.
    """

    def share(self) -> Scalar:
        return 1.0


class VariablePump(LiquidPump):
    """A pump or motor whose displacement is D u, with the signal u limited to -1 .. 1. See `LiquidPump` for the law.

    Negative u delivers from b to a. Losses do not depend on u, as those of a swash plate hardly do.
    """

    u: Input = Input()

    def share(self) -> Scalar:
        return limited(self.u.value, -1.0, 1.0)

    def events(self) -> Events:
        return dict(_most=kink(self.u.value - 1.0), _least=kink(self.u.value + 1.0))


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


class PressureCompensatedPump(ControlledPump):
    """Full displacement up to p_set - band, and none at p_set: target = (p_set - p_b)/band, limited to 0 .. 1.

    See `LiquidPump` for the law, and `PressureCompensatedPump.x` for the swash plate: tau dx/dt = target - x.
    """

    p_set: Param[Scalar, "Pa", positive]  # pressure at which it delivers no more
    band: Param[Scalar, "Pa", positive]  # from full to no displacement

    def target(self) -> Scalar:
        return limited(self._excess(), 0.0, 1.0)

    def _excess(self) -> Scalar:
        return (self.p_set - self.b.p) / self.band

    def events(self) -> Events:
        return dict(_full=kink(self._excess() - 1.0), _none=kink(self._excess()))


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
        return limited(jnp.where(sensed < most, sensed, most), 0.0, 1.0)

    def _excesses(self) -> tuple[Scalar, Scalar]:
        sensed = (self.load.p + self.margin - self.b.p) / self.band
        return sensed, (self.p_set - self.b.p) / self.band_set

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(senses=eq(self.load.q))

    def events(self) -> Events:
        sensed, most = self._excesses()
        return dict(
            _full=kink(sensed - 1.0), _none=kink(sensed),
            _full_set=kink(most - 1.0), _none_set=kink(most), _other=kink(sensed - most),
        )  # fmt: skip
