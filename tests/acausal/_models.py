"""Small models with closed-form solutions, shared by the tests of the engine."""

from typing import Self

import jax.numpy as jnp

from acausal import Array as Parts
from acausal import Component, Connections, Equations, Param, Scalar, Var, connect, eq, positive, replace
from components.electrical import Capacitor, ConstantVoltage, Ground, Pin, Resistor
from components.rotational import ConstantTorque, IdealGear, Inertia, Spring
from components.translational import Fixed, Mass, SpringDamper


class Chain(Component):
    """Inertias joined by springs, free at both ends."""

    masses: Parts[Inertia]
    springs: Parts[Spring]

    def connections(self) -> Connections:
        return (
            connect(self.masses[:-1].b, self.springs[:].a),
            connect(self.masses[1:].a, self.springs[:].b),
        )


class RC(Component):
    """A capacitor charged through a resistor: v = V + (v0 - V) exp(-t / (R C))."""

    source: ConstantVoltage
    r: Resistor
    c: Capacitor
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.source.p, self.r.p),
            connect(self.r.n, self.c.p),
            connect(self.c.n, self.source.n, self.ground.p),
        )


def rc(R: Scalar = 100.0, C: Scalar = 1e-3, V: Scalar = 5.0, v0: Scalar = 0.0) -> RC:
    return RC(source=ConstantVoltage(V=V), r=Resistor(R=R), c=Capacitor(C=C, v=v0))


class Oscillator(Component):
    """A mass between a spring with damper to the wall and nothing: m a + d v + c s = 0."""

    mass: Mass
    link: SpringDamper
    wall: Fixed = Fixed()

    def connections(self) -> Connections:
        return connect(self.wall.flange, self.link.a), connect(self.link.b, self.mass.a)


def oscillator(m: Scalar = 1.0, c: Scalar = 1.0, d: Scalar = 0.0, s0: Scalar = 0.0, v0: Scalar = 0.0) -> Oscillator:
    return Oscillator(mass=Mass(m=m, v=v0), link=SpringDamper(c=c, d=d, s_rel=s0))


class GearTrain(Component):
    """A torque on a rotor that drives another one through a gear: (J1 + J2 / ratio^2) dw1/dt = torque."""

    drive: ConstantTorque
    first: Inertia
    gear: IdealGear
    second: Inertia

    def connections(self) -> Connections:
        return (
            connect(self.drive.flange, self.first.a),
            connect(self.first.b, self.gear.a),
            connect(self.gear.b, self.second.a),
        )


def gear_train(ratio: Scalar, *, torque: Scalar = 0.0, **starts: Scalar) -> GearTrain:
    """With start values of the speeds `w1` and `w2` where they are given."""
    model = GearTrain(
        drive=ConstantTorque(torque=torque),
        first=Inertia(J=1.5),
        gear=IdealGear(ratio=ratio),
        second=Inertia(J=4.0),
    )
    return replace(model, {{"w1": "first.w", "w2": "second.w"}[name]: value for name, value in starts.items()})


class Diode(Component):
    """Shockley's equation, i = I_s (exp(v / V_t) - 1)."""

    saturation: Param[Scalar, "A", positive]  # I_s
    thermal: Param[Scalar, "V", positive] = 0.025  # V_t
    v: Var[Scalar, "V"] = 0.6  # where Newton's method starts
    p: Pin = Pin()
    n: Pin = Pin()

    def equations(self, d: Self) -> Equations:
        return dict(
            voltage=eq(self.v, self.p.v - self.n.v),
            shockley=eq(self.p.i, self.saturation * (jnp.exp(self.v / self.thermal) - 1.0)),
            kirchhoff=eq(self.p.i + self.n.i),
        )


class Rectifier(Component):
    """A capacitor charged through a resistor and a diode."""

    source: ConstantVoltage
    r: Resistor
    diode: Diode
    c: Capacitor
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.source.p, self.r.p),
            connect(self.r.n, self.diode.p),
            connect(self.diode.n, self.c.p),
            connect(self.c.n, self.source.n, self.ground.p),
        )


def rectifier(V: Scalar, R: Scalar = 100.0) -> Rectifier:
    return Rectifier(source=ConstantVoltage(V=V), r=Resistor(R=R), diode=Diode(saturation=1e-12), c=Capacitor(C=1e-3))
