"""Planar port and base classes."""

from typing import Any, ClassVar, Self

import jax.numpy as jnp

from acausal import Component, Equations, Flow, Port, Scalar, Var, eq, positive


class Frame(Port):
    """A coordinate frame on a body in the plane: position, angle against the x axis, force and torque.

    The power into the component is fx dx/dt + fy dy/dt + tau dphi/dt. All components are in the axes of the plane,
    which are fixed; angles are positive from x to y.
    """

    reference: ClassVar[str] = "a Fixed"

    x: Var[Scalar, "m"] = 0.0  # position
    y: Var[Scalar, "m"] = 0.0  # position
    phi: Var[Scalar, "rad"] = 0.0  # angle
    fx: Flow[Scalar, "N"] = 0.0  # force along x, positive into the component
    fy: Flow[Scalar, "N"] = 0.0  # force along y, positive into the component
    tau: Flow[Scalar, "N.m"] = 0.0  # torque, positive into the component

    def power(self, d: Self) -> Scalar:
        return d.x * self.fx + d.y * self.fy + d.phi * self.tau


class TwoFrames(Component, partial=True):
    """A massless element between two frames: the forces at a and b are in balance."""

    a: Frame = Frame()
    b: Frame = Frame()

    def equations(self, d: Any) -> Equations:
        return dict(balance_x=eq(self.a.fx + self.b.fx), balance_y=eq(self.a.fy + self.b.fy))


class AtFrame(Component, partial=True):
    """An element at one frame: vx = dx/dt, vy = dy/dt, w = dphi/dt."""

    vx: Var[Scalar, "m/s"] = 0.0  # speed along x
    vy: Var[Scalar, "m/s"] = 0.0  # speed along y
    w: Var[Scalar, "rad/s"] = 0.0  # angular speed
    frame: Frame = Frame()

    def equations(self, d: Any) -> Equations:
        return dict(
            speed_x=eq(self.vx, d.frame.x),
            speed_y=eq(self.vy, d.frame.y),
            speed=eq(self.w, d.frame.phi),
        )


class Line(TwoFrames, partial=True):
    """A massless element that pulls the origins of two frames towards each other along their line by the force f.

    The length is L = sqrt(x^2 + y^2), from a to b, and must not become zero.
    """

    x: Var[Scalar, "m"] = 1.0  # position of b relative to a
    y: Var[Scalar, "m"] = 0.0  # position of b relative to a
    L: Var[Scalar, "m", positive] = 1.0  # distance of the frames
    f: Var[Scalar, "N"] = 0.0  # force, positive if it pulls the frames together

    def equations(self, d: Any) -> Equations:
        return super().equations(d) | dict(
            relative_x=eq(self.x, self.b.x - self.a.x),
            relative_y=eq(self.y, self.b.y - self.a.y),
            length=eq(self.L, jnp.sqrt(self.x**2 + self.y**2)),
            pull_x=eq(self.b.fx, self.f * self.x / self.L),
            pull_y=eq(self.b.fy, self.f * self.y / self.L),
            no_torque_a=eq(self.a.tau),
            no_torque_b=eq(self.b.tau),
        )
