"""Models with constraints between their states."""

from typing import Any, Self

import jax.numpy as jnp

from acausal import (
    Component,
    Connections,
    Equations,
    Nominal,
    Param,
    Scalar,
    Var,
    Vector,
    connect,
    eq,
    never,
    positive,
    shape,
)
from components.blocks import Sine
from components.electrical import Capacitor, Ground, Resistor, SignalVoltage


class PointOnRod(Component, partial=True):
    """A point mass on a massless rod, in Cartesian coordinates: an index-3 system."""

    L: Param[Scalar, "m", positive] = 1.0
    g: Param[Scalar, "m/s2"] = 9.81
    x: Var[Scalar, "m"] = 0.0
    y: Var[Scalar, "m"] = 0.0
    u: Var[Scalar, "m/s"] = 0.0
    v: Var[Scalar, "m/s"] = 0.0
    force: Var[Scalar, "1/s2", Nominal(100.0)] = 0.0  # in the rod, per length and mass

    def equations(self, d: Any) -> Equations:
        return dict(
            speed_x=eq(self.u, d.x),
            speed_y=eq(self.v, d.y),
            newton_x=eq(d.u, -self.force * self.x),
            newton_y=eq(d.v, -self.force * self.y - self.g),
            rod=eq(self.x**2 + self.y**2, self.L**2),
        )


class Pendulum(PointOnRod):
    """It may turn over, so that no choice of states is good everywhere."""


class Swing(PointOnRod):
    """A pendulum that is known to stay below the horizontal, so that x will do as its state."""

    y: Var[Scalar, "m", never] = -1.0
    v: Var[Scalar, "m/s", never] = 0.0


class DrivenCapacitor(Component):
    """A capacitor straight across a voltage that is given, with a resistor and a second capacitor beside it."""

    signal: Sine
    source: SignalVoltage
    c: Capacitor
    twin: Capacitor
    r: Resistor
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.signal.y, self.source.u),
            connect(self.source.p, self.c.p, self.twin.p, self.r.p),
            connect(self.source.n, self.c.n, self.twin.n, self.r.n, self.ground.p),
        )


def driven_capacitor(amplitude: Any = 3.0, frequency: Any = 2.0) -> DrivenCapacitor:
    return DrivenCapacitor(
        signal=Sine(amplitude=amplitude, frequency=frequency),
        source=SignalVoltage(),
        c=Capacitor(C=0.02),
        twin=Capacitor(C=0.05),
        r=Resistor(R=10.0),
    )


class SliderCrank(Component):
    """A crank drives a slider through a rod whose mass is concentrated at its inclination: index 3, turning over.

    With g1 = r sin(phi) - l sin(psi) = 0 and g2 = x - r cos(phi) - l cos(psi) = 0, by Lagrange's multipliers.
    """

    r: Param[Scalar, "m", positive] = 0.1
    l: Param[Scalar, "m", positive] = 0.3  # noqa: E741
    J: Param[Scalar, "kg.m2", positive] = 0.02
    J_rod: Param[Scalar, "kg.m2", positive] = 0.01
    m: Param[Scalar, "kg", positive] = 2.0
    phi: Var[Scalar, "rad"] = 0.0
    psi: Var[Scalar, "rad"] = 0.0
    x: Var[Scalar, "m"] = 0.0
    w: Var[Scalar, "rad/s"] = 0.0
    w_rod: Var[Scalar, "rad/s"] = 0.0
    v: Var[Scalar, "m/s"] = 0.0
    f1: Var[Scalar, "N"] = 0.0
    f2: Var[Scalar, "N"] = 0.0

    def equations(self, d: Self) -> Equations:
        r, rod = self.r, self.l
        return dict(
            speed=eq(self.w, d.phi),
            speed_rod=eq(self.w_rod, d.psi),
            speed_slider=eq(self.v, d.x),
            height=eq(r * jnp.sin(self.phi), rod * jnp.sin(self.psi)),
            length=eq(self.x, r * jnp.cos(self.phi) + rod * jnp.cos(self.psi)),
            crank=eq(self.J * d.w, -r * (jnp.cos(self.phi) * self.f1 + jnp.sin(self.phi) * self.f2)),
            rod=eq(self.J_rod * d.w_rod, rod * (jnp.cos(self.psi) * self.f1 - jnp.sin(self.psi) * self.f2)),
            slider=eq(self.m * d.v, -self.f2),
        )

    def kinetic_energy(self) -> Scalar:
        return 0.5 * (self.J * self.w**2 + self.J_rod * self.w_rod**2 + self.m * self.v**2)


class FourBar(Component):
    """A crank that turns fully, a coupler and a rocker, with inertias about their joints: index 3."""

    lengths: Param[Vector, "m"]  # of crank, coupler, rocker and frame
    J: Param[Vector, "kg.m2"]  # of crank, coupler and rocker
    angles: Var[Vector, "rad", shape(3)] = 0.0  # pyright: ignore[reportAssignmentType]
    w: Var[Vector, "rad/s", shape(3)] = 0.0  # pyright: ignore[reportAssignmentType]
    force: Var[Vector, "N", shape(2)] = 0.0  # pyright: ignore[reportAssignmentType]

    def closure(self) -> Any:
        a, b, c, frame = self.lengths
        along = a * jnp.cos(self.angles[0]) + b * jnp.cos(self.angles[1]) - c * jnp.cos(self.angles[2]) - frame
        across = a * jnp.sin(self.angles[0]) + b * jnp.sin(self.angles[1]) - c * jnp.sin(self.angles[2])
        return jnp.stack([along, across])

    def equations(self, d: Self) -> Equations:
        arms = self.lengths[:3] * jnp.array([1.0, 1.0, -1.0])
        torques = arms * (jnp.sin(self.angles) * self.force[0] - jnp.cos(self.angles) * self.force[1])
        return dict(
            speeds=eq(self.w, d.angles),
            closed=eq(self.closure()),
            newton=eq(self.J * d.w, torques),
        )

    def kinetic_energy(self) -> Scalar:
        return 0.5 * jnp.sum(self.J * self.w**2)
