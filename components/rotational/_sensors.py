"""Ideal sensors: no torque, no inertia."""

from typing import Any, Self

from acausal import Component, Equations, Scalar, Var, eq

from ..blocks import Output
from ._interfaces import Flange


class AngleSensor(Component):
    """y = phi in rad."""

    flange: Flange = Flange()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(no_torque=eq(self.flange.tau), reading=eq(self.y.value, self.flange.phi))


class SpeedSensor(Component):
    """y = dphi/dt in rad/s."""

    flange: Flange = Flange()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(no_torque=eq(self.flange.tau), reading=eq(self.y.value, d.flange.phi))


class RigidSensor(Component, partial=True):
    """A sensor through which a torque passes from a to b."""

    a: Flange = Flange()
    b: Flange = Flange()

    def equations(self, d: Any) -> Equations:
        return dict(rigid=eq(self.a.phi, self.b.phi), balance=eq(self.a.tau + self.b.tau))


class TorqueSensor(RigidSensor):
    """y = torque transmitted from a to b in N.m."""

    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(reading=eq(self.y.value, self.a.tau))


class AccelerationSensor(Component):
    """y = d2phi/dt2 in rad/s2."""

    w: Var[Scalar, "rad/s"] = 0.0  # speed
    flange: Flange = Flange()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(
            no_torque=eq(self.flange.tau),
            speed=eq(self.w, d.flange.phi),
            reading=eq(self.y.value, d.w),
        )


class RelativeSensor(Component, partial=True):
    """A sensor between two flanges, with phi_rel = phi_b - phi_a."""

    phi_rel: Var[Scalar, "rad"] = 0.0  # relative angle
    a: Flange = Flange()
    b: Flange = Flange()
    y: Output = Output()

    def equations(self, d: Any) -> Equations:
        return dict(
            no_torque_a=eq(self.a.tau),
            no_torque_b=eq(self.b.tau),
            relative=eq(self.phi_rel, self.b.phi - self.a.phi),
        )


class RelativeAngleSensor(RelativeSensor):
    """y = phi_b - phi_a in rad."""

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(reading=eq(self.y.value, self.phi_rel))


class RelativeSpeedSensor(RelativeSensor):
    """y = d(phi_b - phi_a)/dt in rad/s."""

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(reading=eq(self.y.value, d.phi_rel))


class PowerSensor(RigidSensor):
    """y = power transmitted from a to b in W."""

    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(reading=eq(self.y.value, self.a.tau * d.a.phi))


class MultiSensor(RigidSensor):
    """Three outputs: speed in rad/s, and torque in N.m and power in W transmitted from a to b."""

    speed: Output = Output()
    torque: Output = Output()
    power: Output = Output()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            speed=eq(self.speed.value, d.a.phi),
            torque=eq(self.torque.value, self.a.tau),
            power=eq(self.power.value, self.torque.value * self.speed.value),
        )
