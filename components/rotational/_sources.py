"""Ideal drives; the reaction acts on the ground."""

from typing import Self

from acausal import Component, Energy, Equations, Param, Scalar, eq

from ..blocks import Input
from ._interfaces import Flange, ToGround


class ConstantTorque(ToGround):
    """Drives the flange with a constant torque: tau_flange = -torque."""

    torque: Param[Scalar, "N.m"]  # torque on what is connected

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drive=eq(self.flange.tau, -self.torque))

    def energy(self) -> Energy:
        return Energy(supplied=self.torque * self.w)


class SignalTorque(ToGround):
    """Drives the flange with the torque u in N.m: tau_flange = -u."""

    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drive=eq(self.flange.tau, -self.u.value))

    def energy(self) -> Energy:
        return Energy(supplied=self.u.value * self.w)


class SignalSpeed(Component):
    """Turns the flange with the speed u in rad/s, whatever the torque."""

    u: Input = Input()
    flange: Flange = Flange()

    def equations(self, d: Self) -> Equations:
        return dict(drive=eq(d.flange.phi, self.u.value))

    def energy(self) -> Energy:
        return Energy(supplied=-self.flange.tau * self.u.value)
