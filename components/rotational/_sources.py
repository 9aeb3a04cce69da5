"""Ideal sources of torque and of motion; the reaction acts on the ground unless there is a second flange.

A motion must be smooth enough for the accelerations of the driven inertias to exist. If the signal jumps, filter it,
for example with `blocks.FirstOrder` for a speed or `blocks.SecondOrder` for an angle.
"""

from collections.abc import Mapping
from typing import ClassVar, Self

from acausal import Component, Energy, Equations, Param, Scalar, Var, eq, nonzero, prefer

from .._limit import absolute
from ..blocks import Input
from ._interfaces import Compliant, Flange, ToGround


class ConstantTorque(ToGround):
    """Drives the flange with a constant torque: tau_flange = -torque."""

    elsewhere: ClassVar[Mapping[str, str]] = {"tau_constant": "torque"}

    torque: Param[Scalar, "N.m"]  # torque on the connected part

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


class SignalTorque2(Compliant):
    """Drives b with the torque u in N.m against a: tau_b = -u = -tau_a (MSL `Torque2`)."""

    w_rel: Var[Scalar, "rad/s"] = 0.0  # relative speed
    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            relative_speed=eq(self.w_rel, d.phi_rel),
            drive=eq(self.tau, -self.u.value),
        )

    def energy(self) -> Energy:
        return Energy(supplied=self.u.value * self.w_rel)


class LinearSpeedDependentTorque(ToGround):
    """Drives the flange with torque w / w_nominal; a load if torque < 0."""

    elsewhere: ClassVar[Mapping[str, str]] = {"tau_nominal": "torque"}

    torque: Param[Scalar, "N.m"]  # torque on the connected part at w_nominal
    w_nominal: Param[Scalar, "rad/s", nonzero]  # nominal speed

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drive=eq(self.flange.tau, -self._drive()))

    def _drive(self) -> Scalar:
        return self.torque * self.w / self.w_nominal

    def energy(self) -> Energy:
        return Energy(supplied=self._drive() * self.w)


class QuadraticSpeedDependentTorque(ToGround):
    """Drives the flange with torque (w / w_nominal)^2; a load such as a fan or pump if torque < 0.

    As by default in MSL, the torque keeps its sign when the speed reverses. With `one_sign=False` it reverses too:
    torque w |w| / w_nominal^2.
    """

    elsewhere: ClassVar[Mapping[str, str]] = {"tau_nominal": "torque", "TorqueDirection": "one_sign"}

    torque: Param[Scalar, "N.m"]  # torque on the connected part at w_nominal
    w_nominal: Param[Scalar, "rad/s", nonzero]  # nominal speed
    one_sign: bool = True

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drive=eq(self.flange.tau, -self._drive()))

    def _drive(self) -> Scalar:
        square = self.w**2 if self.one_sign else self.w * absolute(self.w)
        return self.torque * square / self.w_nominal**2

    def energy(self) -> Energy:
        return Energy(supplied=self._drive() * self.w)


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
