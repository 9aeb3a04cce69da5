"""Ideal drives; the reaction acts on the ground."""

from typing import Self

from acausal import Energy, Equations, Param, Scalar, eq

from ..blocks import Input
from ._interfaces import ToGround


class ConstantForce(ToGround):
    """Pushes the flange with a constant force: f_flange = -force."""

    force: Param[Scalar, "N"]  # force on what is connected

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drive=eq(self.flange.f, -self.force))

    def energy(self) -> Energy:
        return Energy(supplied=self.force * self.v)


class SignalForce(ToGround):
    """Pushes the flange with the force u in N: f_flange = -u."""

    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drive=eq(self.flange.f, -self.u.value))

    def energy(self) -> Energy:
        return Energy(supplied=self.u.value * self.v)


class SignalPosition(ToGround):
    """Holds the flange at the position u in m, whatever the force; u has to be smooth."""

    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drive=eq(self.flange.s, self.u.value))

    def energy(self) -> Energy:
        return Energy(supplied=-self.flange.f * self.v)
