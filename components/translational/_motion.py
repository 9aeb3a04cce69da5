"""Ideal drives by motion, whatever the force; the reaction acts on the ground.

A motion has to be smooth enough to have the accelerations that masses need. To follow a signal that jumps, put a
filter before it, such as `blocks.FirstOrder` before a speed or `blocks.SecondOrder` before a position.
"""

from collections.abc import Mapping
from typing import ClassVar, Self

from acausal import Energy, Equations, Param, Scalar, Var, eq, prefer

from ..blocks import Input
from ._interfaces import ToGround


class Motion(ToGround, partial=True):
    """A drive by motion."""

    def energy(self) -> Energy:
        return Energy(supplied=-self.flange.f * self.v)


class SignalPosition(Motion):
    """Holds the flange at the position u in m; u has to be smooth."""

    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drive=eq(self.flange.s, self.u.value))


class ConstantSpeed(Motion):
    """Moves the flange with a constant speed."""

    elsewhere: ClassVar[Mapping[str, str]] = {"v_fixed": "speed"}

    speed: Param[Scalar, "m/s"]  # speed of the flange

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drive=eq(self.v, self.speed))


class SignalSpeed(Motion):
    """Moves the flange with the speed u in m/s, which has to be continuous where it drives a mass."""

    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drive=eq(self.v, self.u.value))


class SignalAcceleration(Motion):
    """Moves the flange with the acceleration u in m/s2; its speed and position are states (MSL `Accelerate`)."""

    v: Var[Scalar, "m/s", prefer] = 0.0  # speed
    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drive=eq(d.v, self.u.value))
