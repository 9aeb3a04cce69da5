"""Bodies, fixed frame and rigid links."""

from typing import Self

import jax.numpy as jnp

from acausal import Component, Energy, Equations, Param, Scalar, Var, eq, nonnegative, positive

from ._interfaces import AtFrame, Frame, TwoFrames


class Fixed(Component):
    """A frame fixed in the plane, at the origin and parallel to it by default (PlanarMechanics `Fixed`)."""

    x0: Param[Scalar, "m"] = 0.0  # position
    y0: Param[Scalar, "m"] = 0.0  # position
    phi0: Param[Scalar, "rad"] = 0.0  # angle
    frame: Frame = Frame()

    def equations(self, d: Self) -> Equations:
        return dict(
            held_x=eq(self.frame.x, self.x0),
            held_y=eq(self.frame.y, self.y0),
            held_phi=eq(self.frame.phi, self.phi0),
        )


class Body(AtFrame):
    """A rigid body with its frame at the centre of mass; gravity acts along -y (PlanarMechanics `Body`).

    m dvx/dt = fx, m dvy/dt = fy - m g, J dw/dt = tau. In a horizontal plane, g = 0.
    """

    m: Param[Scalar, "kg", positive]  # mass
    J: Param[Scalar, "kg.m2", positive]  # moment of inertia about the centre of mass
    g: Param[Scalar, "m/s2", nonnegative] = 9.80665  # acceleration of gravity

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            newton_x=eq(self.m * d.vx, self.frame.fx),
            newton_y=eq(self.m * d.vy, self.frame.fy - self.m * self.g),
            euler=eq(self.J * d.w, self.frame.tau),
        )

    def energy(self) -> Energy:
        kinetic = 0.5 * self.m * (self.vx**2 + self.vy**2) + 0.5 * self.J * self.w**2
        return Energy(stored=kinetic + self.m * self.g * self.frame.y)


class Bar(Component):
    """A uniform slender bar of mass m from a to b along the x axis of a; gravity acts along -y.

    Newton's and Euler's laws at the centre, with the moment of inertia m L^2/12. In a horizontal plane, g = 0. A body
    of another shape is a `FixedTranslation` from each joint to a `Body` at the centre of mass.
    """

    m: Param[Scalar, "kg", positive]  # mass
    L: Param[Scalar, "m", positive]  # length from a to b
    g: Param[Scalar, "m/s2", nonnegative] = 9.80665  # acceleration of gravity
    a: Frame = Frame()
    b: Frame = Frame()
    x: Var[Scalar, "m"] = 0.0  # position of the centre
    y: Var[Scalar, "m"] = 0.0  # position of the centre
    vx: Var[Scalar, "m/s"] = 0.0  # speed of the centre along x
    vy: Var[Scalar, "m/s"] = 0.0  # speed of the centre along y
    w: Var[Scalar, "rad/s"] = 0.0  # angular speed

    def equations(self, d: Self) -> Equations:
        half_x, half_y = 0.5 * self.L * jnp.cos(self.a.phi), 0.5 * self.L * jnp.sin(self.a.phi)
        turning = half_x * (self.b.fy - self.a.fy) - half_y * (self.b.fx - self.a.fx)
        return dict(
            start_x=eq(self.a.x, self.x - half_x),
            start_y=eq(self.a.y, self.y - half_y),
            end_x=eq(self.b.x, self.x + half_x),
            end_y=eq(self.b.y, self.y + half_y),
            rigid=eq(self.a.phi, self.b.phi),
            speed_x=eq(self.vx, d.x),
            speed_y=eq(self.vy, d.y),
            speed=eq(self.w, d.a.phi),
            newton_x=eq(self.m * d.vx, self.a.fx + self.b.fx),
            newton_y=eq(self.m * d.vy, self.a.fy + self.b.fy - self.m * self.g),
            euler=eq(self._inertia() * d.w, self.a.tau + self.b.tau + turning),
        )

    def _inertia(self) -> Scalar:
        return self.m * self.L**2 / 12.0

    def energy(self) -> Energy:
        kinetic = 0.5 * self.m * (self.vx**2 + self.vy**2) + 0.5 * self._inertia() * self.w**2
        return Energy(stored=kinetic + self.m * self.g * self.y)


class FixedTranslation(TwoFrames):
    """A rigid massless link: b is at (rx, ry) in the axes of a (PlanarMechanics `FixedTranslation`)."""

    rx: Param[Scalar, "m"]  # position of b along the x axis of a
    ry: Param[Scalar, "m"] = 0.0  # position of b along the y axis of a

    def equations(self, d: Self) -> Equations:
        cosine, sine = jnp.cos(self.a.phi), jnp.sin(self.a.phi)
        x, y = cosine * self.rx - sine * self.ry, sine * self.rx + cosine * self.ry
        return super().equations(d) | dict(
            position_x=eq(self.b.x, self.a.x + x),
            position_y=eq(self.b.y, self.a.y + y),
            rigid=eq(self.a.phi, self.b.phi),
            balance=eq(self.a.tau + self.b.tau, y * self.b.fx - x * self.b.fy),
        )
