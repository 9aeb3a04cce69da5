"""Eddy-current brake with heating, and iron losses of a rotor."""

from typing import Self

import jax.numpy as jnp

from acausal import Energy, Equations, Param, Scalar, Var, eq, nonnegative, positive

from ..thermal import HeatPort
from ._interfaces import ToGround

_COPPER = 3.92e-3  # temperature coefficient in 1/K at T20


class EddyCurrentBrake(ToGround):
    """A disc braked by eddy currents, which heat it (MSL `EddyCurrentTorque`).

    tau = 2 tau_nominal x / (1 + x^2), with the maximum torque at x = 1. The speed at x = 1 grows with the resistance
    of the disc: x = w / [w_nominal (1 + alpha (T - T_ref))], with alpha = alpha20 / (1 + alpha20 (T_ref - T20)).

    The loss tau w leaves through the heat port, which must be connected, for example to a `FixedTemperature`. The
    energy account of the brake therefore shows no dissipation.
    """

    tau_nominal: Param[Scalar, "N.m", nonnegative]  # maximum torque
    w_nominal: Param[Scalar, "rad/s", positive]  # speed of the maximum torque at T_ref
    T_ref: Param[Scalar, "K", positive] = 293.15  # reference temperature
    alpha20: Param[Scalar, "1/K"] = _COPPER  # temperature coefficient of the resistance at T20
    T20: Param[Scalar, "K", positive] = 293.15  # reference temperature of alpha20
    loss: Var[Scalar, "W"] = 0.0  # braking power tau w
    heat: HeatPort = HeatPort()

    def torque(self) -> Scalar:
        """Braking torque at the current speed and temperature."""
        alpha = self.alpha20 / (1.0 + self.alpha20 * (self.T_ref - self.T20))
        # x = w / r; numerator and denominator of the law are multiplied by r^2.
        r = self.w_nominal * (1.0 + alpha * (self.heat.T - self.T_ref))
        return 2.0 * self.tau_nominal * self.w * r / (r**2 + self.w**2)

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            brake=eq(self.flange.tau, self.torque()),
            loss=eq(self.loss, self.flange.tau * self.w),
            heat=eq(self.heat.Q_flow, -self.loss),
        )


class IronLoss(ToGround):
    """Drag of an iron core that turns in a constant field, tau = T_h tanh(w/w_0) + k_e w: hysteresis, eddy currents.

    Hysteresis dissipates a fixed energy per turn, eddy currents a power proportional to the square of the frequency
    (Steinmetz; Bertotti, IEEE Trans. Magn. 24, 1988, without the excess term). Two no-load currents of a data sheet
    give both terms, with bearing and brush friction. Below w_0 the hysteresis torque fades out: the core creeps where a
    real one is held. With `heat=HeatPort()` the loss leaves as heat. Not modelled: cogging, fields of the currents.
    """

    T_h: Param[Scalar, "N.m", nonnegative] = 0.0  # hysteresis torque
    k_e: Param[Scalar, "N.m.s/rad", nonnegative] = 0.0  # eddy-current drag per speed
    w_0: Param[Scalar, "rad/s", positive] = 1.0  # width of the transition through rest
    heat: HeatPort | None = None

    def _drag(self) -> Scalar:
        return self.T_h * jnp.tanh(self.w / self.w_0) + self.k_e * self.w

    def equations(self, d: Self) -> Equations:
        heat = {} if self.heat is None else dict(loss=eq(self.heat.Q_flow, -self._drag() * self.w))
        return super().equations(d) | heat | dict(drag=eq(self.flange.tau, self._drag()))

    def energy(self) -> Energy:
        return Energy(dissipated=self._drag() * self.w if self.heat is None else 0.0)
