"""Ideal sensors, without torque or inertia, and an incremental encoder."""

from typing import Any, Self

import jax.numpy as jnp

from acausal import Component, Discrete, Equations, Events, Param, Scalar, Time, Var, at, eq, positive

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


class Encoder(Component):
    """Angle and speed from counts N = floor(phi/step), step = 2 pi/counts, sampled at 0, period, 2 period, ...

    angle = step N in rad, less than one step behind phi at a sample; speed = step (N - N_before)/period in rad/s, with
    the resolution step/period and a delay of half a period. Both are held between samples. The counts per turn are four
    times the lines of an incremental encoder with two tracks. No torque, no inertia. Because the counts jump,
    derivatives of a run do not propagate through them. Not modelled: index pulse, line errors, frequency limit.
    """

    counts: Param[Scalar, "1", positive]  # counts per turn
    period: Param[Scalar, "s", positive]  # sample period
    t: Time[Scalar, "s"] = 0.0
    count: Discrete[Scalar, "1"] = 0.0  # at the last sample
    change: Discrete[Scalar, "1"] = 0.0  # of the count since the previous sample
    begun: Discrete[Scalar, "1"] = 0.0  # 1 after the first sample
    flange: Flange = Flange()
    angle: Output = Output()
    speed: Output = Output()

    def _step(self) -> Scalar:
        return 2.0 * jnp.pi / self.counts

    def equations(self, d: Self) -> Equations:
        return dict(
            no_torque=eq(self.flange.tau),
            angle=eq(self.angle.value, self._step() * self.count),
            speed=eq(self.speed.value, self._step() * self.change / self.period),
        )

    def events(self) -> Events:
        count = jnp.floor(self.flange.phi / self._step())
        change = self.begun * (count - self.count)
        return dict(reading=at(0.0, every=self.period, count=count, change=change, begun=1.0))
