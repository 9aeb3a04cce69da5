"""Ideal sensors: no force, no mass."""

from typing import Any, Self

from acausal import Component, Equations, eq

from ..blocks import Output
from ._interfaces import Frame, Line, TwoFrames


class FrameSensor(Component, partial=True):
    """A sensor at one frame."""

    frame: Frame = Frame()

    def equations(self, d: Any) -> Equations:
        del d
        return dict(
            no_force_x=eq(self.frame.fx),
            no_force_y=eq(self.frame.fy),
            no_torque=eq(self.frame.tau),
        )


class PositionSensor(FrameSensor):
    """Position of a frame in m and its angle in rad (PlanarMechanics `AbsolutePosition`)."""

    x: Output = Output()
    y: Output = Output()
    phi: Output = Output()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            x=eq(self.x.value, self.frame.x),
            y=eq(self.y.value, self.frame.y),
            phi=eq(self.phi.value, self.frame.phi),
        )


class SpeedSensor(FrameSensor):
    """Speeds of a frame in m/s and its angular speed in rad/s (PlanarMechanics `AbsoluteVelocity`)."""

    vx: Output = Output()
    vy: Output = Output()
    w: Output = Output()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            vx=eq(self.vx.value, d.frame.x),
            vy=eq(self.vy.value, d.frame.y),
            w=eq(self.w.value, d.frame.phi),
        )


class DistanceSensor(Line):
    """Distance of two frames in m, which must not become zero (PlanarMechanics `Distance`)."""

    reading: Output = Output()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(no_force=eq(self.f), reading=eq(self.reading.value, self.L))


class ForceSensor(TwoFrames):
    """Forces in N and torque in N.m from a to b, in the axes of the plane (PlanarMechanics `CutForceAndTorque`)."""

    fx: Output = Output()
    fy: Output = Output()
    tau: Output = Output()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            same_x=eq(self.a.x, self.b.x),
            same_y=eq(self.a.y, self.b.y),
            same_phi=eq(self.a.phi, self.b.phi),
            balance=eq(self.a.tau + self.b.tau),
            fx=eq(self.fx.value, self.a.fx),
            fy=eq(self.fy.value, self.a.fy),
            tau=eq(self.tau.value, self.a.tau),
        )
