"""Ideal sources of force and of motion; the reaction acts on the ground unless there is a second flange.

A motion must be smooth enough for the accelerations of the driven masses to exist. If the signal jumps, filter it,
for example with `blocks.FirstOrder` for a speed or `blocks.SecondOrder` for a position.
"""

from collections.abc import Mapping
from typing import ClassVar, Self

from acausal import Energy, Equations, Param, Scalar, Var, eq, nonzero, prefer

from .._limit import absolute
from ..blocks import Input
from ._interfaces import Compliant, ToGround


class ConstantForce(ToGround):
    """Pushes the flange with a constant force: f_flange = -force."""

    elsewhere: ClassVar[Mapping[str, str]] = {"f_constant": "force"}

    force: Param[Scalar, "N"]  # force on the connected part

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


class SignalForce2(Compliant):
    """Pushes b with the force u in N against a: f_b = -u = -f_a (MSL `Force2`)."""

    v_rel: Var[Scalar, "m/s"] = 0.0  # relative speed
    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            relative_speed=eq(self.v_rel, d.s_rel),
            drive=eq(self.f, -self.u.value),
        )

    def energy(self) -> Energy:
        return Energy(supplied=self.u.value * self.v_rel)


class LinearSpeedDependentForce(ToGround):
    """Pushes the flange with force v / v_nominal; a load if force < 0."""

    elsewhere: ClassVar[Mapping[str, str]] = {"f_nominal": "force"}

    force: Param[Scalar, "N"]  # force on the connected part at v_nominal
    v_nominal: Param[Scalar, "m/s", nonzero]  # nominal speed

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drive=eq(self.flange.f, -self._drive()))

    def _drive(self) -> Scalar:
        return self.force * self.v / self.v_nominal

    def energy(self) -> Energy:
        return Energy(supplied=self._drive() * self.v)


class QuadraticSpeedDependentForce(ToGround):
    """Pushes the flange with force (v / v_nominal)^2; a load such as air drag if force < 0.

    As by default in MSL, the force keeps its sign when the speed reverses. With `one_sign=False` it reverses too:
    force v |v| / v_nominal^2.
    """

    elsewhere: ClassVar[Mapping[str, str]] = {"f_nominal": "force", "ForceDirection": "one_sign"}

    force: Param[Scalar, "N"]  # force on the connected part at v_nominal
    v_nominal: Param[Scalar, "m/s", nonzero]  # nominal speed
    one_sign: bool = True

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drive=eq(self.flange.f, -self._drive()))

    def _drive(self) -> Scalar:
        square = self.v**2 if self.one_sign else self.v * absolute(self.v)
        return self.force * square / self.v_nominal**2

    def energy(self) -> Energy:
        return Energy(supplied=self._drive() * self.v)


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
