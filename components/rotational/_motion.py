"""Ideal motion sources, which supply any torque; the reaction acts on the ground.

A motion must be smooth enough for the accelerations of the driven inertias to exist. If the signal jumps, filter it,
for example with `blocks.FirstOrder` for a speed or `blocks.SecondOrder` for an angle.
"""

from collections.abc import Mapping
from typing import ClassVar, Self

from acausal import Component, Energy, Equations, Param, Scalar, Var, eq, prefer

from ..blocks import Input
from ._interfaces import Flange, ToGround


class SignalAngle(ToGround):
    """Holds the flange at the angle u in rad; u must be smooth (MSL `Position`)."""

    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drive=eq(self.flange.phi, self.u.value))

    def energy(self) -> Energy:
        return Energy(supplied=-self.flange.tau * self.w)


class ConstantSpeed(Component):
    """Turns the flange at a constant speed."""

    elsewhere: ClassVar[Mapping[str, str]] = {"w_fixed": "speed"}

    speed: Param[Scalar, "rad/s"]  # speed of the flange
    flange: Flange = Flange()

    def equations(self, d: Self) -> Equations:
        return dict(drive=eq(d.flange.phi, self.speed))

    def energy(self) -> Energy:
        return Energy(supplied=-self.flange.tau * self.speed)


class SignalSpeed(Component):
    """Turns the flange at the speed u in rad/s, which must be continuous if the flange drives an inertia."""

    u: Input = Input()
    flange: Flange = Flange()

    def equations(self, d: Self) -> Equations:
        return dict(drive=eq(d.flange.phi, self.u.value))

    def energy(self) -> Energy:
        return Energy(supplied=-self.flange.tau * self.u.value)


class SignalAcceleration(ToGround):
    """Turns the flange at the acceleration u in rad/s2; its speed and angle are states (MSL `Accelerate`)."""

    w: Var[Scalar, "rad/s", prefer] = 0.0  # speed
    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drive=eq(d.w, self.u.value))

    def energy(self) -> Energy:
        return Energy(supplied=-self.flange.tau * self.w)
