"""Ideal motion sources, which supply any force; the reaction acts on the ground.

A motion must be smooth enough for the accelerations of the driven masses to exist. If the signal jumps, filter it, for
example with `blocks.FirstOrder` for a speed or `blocks.SecondOrder` for a position.
"""

from collections.abc import Mapping
from typing import ClassVar, Self

from acausal import Energy, Equations, Param, Scalar, Var, eq, prefer

from ..blocks import Input
from ._interfaces import ToGround


class Motion(ToGround, partial=True):
    """Base class of motion sources."""

    def energy(self) -> Energy:
        return Energy(supplied=-self.flange.f * self.v)


class SignalPosition(Motion):
    """Holds the flange at the position u in m; u must be smooth."""

    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drive=eq(self.flange.s, self.u.value))


class ConstantSpeed(Motion):
    """Moves the flange at a constant speed."""

    elsewhere: ClassVar[Mapping[str, str]] = {"v_fixed": "speed"}

    speed: Param[Scalar, "m/s"]  # speed of the flange

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drive=eq(self.v, self.speed))


class SignalSpeed(Motion):
    """Moves the flange at the speed u in m/s, which must be continuous if the flange drives a mass."""

    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drive=eq(self.v, self.u.value))


class SignalAcceleration(Motion):
    """Moves the flange at the acceleration u in m/s2; its speed and position are states (MSL `Accelerate`)."""

    v: Var[Scalar, "m/s", prefer] = 0.0  # speed
    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drive=eq(d.v, self.u.value))
