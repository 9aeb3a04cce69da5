"""Pumps and motors with a `Liquid`: its viscosity determines the losses, its density at the inlet the delivery."""

import abc
from typing import Any

import jax.numpy as jnp

from acausal import (
    Energy,
    Equations,
    Events,
    Param,
    Requirements,
    Scalar,
    eq,
    nonnegative,
    positive,
    require,
)

from .._limit import limited
from ..blocks import Input
from ._liquids import AnyLiquid
from ._pump import DisplacementMachine
from ._pump_losses import PumpLosses


class LiquidPump(DisplacementMachine, partial=True):
    """A displacement machine: q = x D w r - slip from a to b, and J dw/dt = tau - x D r dp - drag, with dp = p_b - p_a.

    x is the displacement setting, a fraction of the displacement D, and r the density at the inlet over that at
    atmospheric pressure; `losses` gives slip and drag. The inlet is a for x w > 0 and b otherwise, smoothed by
    tanh(x w/w_t). If the liquid cavitates there, it fills the chambers incompletely: as the inlet pressure falls to the
    vapour pressure, the delivery fades out. With `heat=HeatPort()` the losses leave as heat, and the viscosity is that
    at its temperature. Not modelled: compression in the pump, case drain.
    """

    liquid: AnyLiquid
    losses: PumpLosses
    J: Param[Scalar, "kg.m2", nonnegative] = 0.0  # moment of inertia
    w_t: Param[Scalar, "rad/s", positive] = 1.0  # speed range in which the inlet changes sides

    @abc.abstractmethod
    def share(self) -> Scalar:
        """Displacement setting x; negative for delivery from b to a."""

    def equations(self, d: Any) -> Equations:
        filled = self.displacement * self.share() * self._filling()
        return super().equations(d) | dict(
            flow=eq(self.q, filled * self.w - self._slip()),
            newton=eq(self.J * d.w, self.shaft.tau - filled * self.dp - self._drag()),
        )

    def held_liquid(self) -> Scalar:
        """That of one revolution."""
        return 2.0 * jnp.pi * self.displacement

    def events(self) -> Events:
        return self.losses.events(self.dp, self.w)

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.J * self.w**2, dissipated=self._loss())

    def _loss(self) -> Scalar:
        return self._slip() * self.dp + self._drag() * self.w

    def _filling(self) -> Scalar:
        at_a, at_b = (self.liquid.relative_density(port.p) for port in (self.a, self.b))
        return 0.5 * (at_a + at_b + (at_a - at_b) * jnp.tanh(self.share() * self.w / self.w_t))

    def _viscosity(self) -> Scalar:
        nu = self.liquid.kinematic_viscosity(0.5 * (self.a.p + self.b.p), self._temperature())
        return self.liquid.reference_density * nu

    def _slip(self) -> Scalar:
        return self.losses.slip(self.displacement, self.dp, self.w, self._viscosity(), self.liquid.reference_density)

    def _drag(self) -> Scalar:
        return self.losses.drag(self.displacement, self.dp, self.w, self._viscosity(), self.liquid.reference_density)


class FixedPump(LiquidPump):
    """Pump or motor of fixed displacement with the losses of Wilson or Schloesser. See `LiquidPump` for the law.

    `Pump` is the counterpart with constant density and constant loss coefficients.
    """

    def share(self) -> Scalar:
        return 1.0


class RipplingPump(LiquidPump):
    """A `FixedPump` with delivery ripple over the shaft angle: x = 1 + ripple cos(pulses phi).

    The first harmonic of the sum of the piston or tooth strokes. `pulses` is the number of teeth, or of pistons if it
    is even, and twice an odd number of pistons (Ivantysyn, Ivantysynova 2001). The torque has the same ripple, without
    loss of energy. A run must resolve every pulse, so the number of its steps grows with the number of pulses.
    """

    ripple: Param[Scalar, "1", nonnegative]  # amplitude over the mean delivery, below 1; 0.01 for nine pistons
    pulses: Param[Scalar, "1/rad", positive]  # angular frequency of the ripple over that of the shaft

    def requirements(self) -> Requirements:
        return (require(self.ripple < 1.0, "ripple must be below 1"),)

    def share(self) -> Scalar:
        return 1.0 + self.ripple * jnp.cos(self.pulses * self.shaft.phi)


class VariablePump(LiquidPump):
    """A pump or motor with the displacement D u, with the signal u limited to -1 .. 1. See `LiquidPump` for the law.

    For negative u it delivers from b to a. The losses do not depend on u, as is nearly true of a swash plate.
    """

    u: Input = Input()

    def share(self) -> Scalar:
        return limited(self.u.value, -1.0, 1.0)
