"""Eddy-current brake with heating."""

from typing import Self

from acausal import Equations, Param, Scalar, Var, eq, nonnegative, positive

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
