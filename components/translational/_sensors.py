"""Ideal sensors: no force, no mass."""

from typing import Any, Self

from acausal import Component, Equations, Scalar, Var, eq

from ..blocks import Output
from ._interfaces import Flange


class PositionSensor(Component):
    """y = s in m."""

    flange: Flange = Flange()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(no_force=eq(self.flange.f), reading=eq(self.y.value, self.flange.s))


class SpeedSensor(Component):
    """y = ds/dt in m/s."""

    flange: Flange = Flange()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(no_force=eq(self.flange.f), reading=eq(self.y.value, d.flange.s))


class RigidSensor(Component, partial=True):
    """A sensor through which a force passes from a to b."""

    a: Flange = Flange()
    b: Flange = Flange()

    def equations(self, d: Any) -> Equations:
        return dict(rigid=eq(self.a.s, self.b.s), balance=eq(self.a.f + self.b.f))


class ForceSensor(RigidSensor):
    """y = force transmitted from a to b in N."""

    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(reading=eq(self.y.value, self.a.f))


class AccelerationSensor(Component):
    """y = d2s/dt2 in m/s2."""

    v: Var[Scalar, "m/s"] = 0.0  # speed
    flange: Flange = Flange()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(
            no_force=eq(self.flange.f),
            speed=eq(self.v, d.flange.s),
            reading=eq(self.y.value, d.v),
        )


class RelativeSensor(Component, partial=True):
    """A sensor between two flanges, with s_rel = s_b - s_a."""

    s_rel: Var[Scalar, "m"] = 0.0  # relative position
    a: Flange = Flange()
    b: Flange = Flange()
    y: Output = Output()

    def equations(self, d: Any) -> Equations:
        return dict(
            no_force_a=eq(self.a.f),
            no_force_b=eq(self.b.f),
            relative=eq(self.s_rel, self.b.s - self.a.s),
        )


class RelativePositionSensor(RelativeSensor):
    """y = s_b - s_a in m."""

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(reading=eq(self.y.value, self.s_rel))


class RelativeSpeedSensor(RelativeSensor):
    """y = d(s_b - s_a)/dt in m/s."""

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(reading=eq(self.y.value, d.s_rel))


class PowerSensor(RigidSensor):
    """y = power transmitted from a to b in W."""

    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(reading=eq(self.y.value, self.a.f * d.a.s))


class MultiSensor(RigidSensor):
    """Three outputs: speed in m/s, and force in N and power in W transmitted from a to b."""

    speed: Output = Output()
    force: Output = Output()
    power: Output = Output()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            speed=eq(self.speed.value, d.a.s),
            force=eq(self.force.value, self.a.f),
            power=eq(self.power.value, self.force.value * self.speed.value),
        )
