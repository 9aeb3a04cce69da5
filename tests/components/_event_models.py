"""Examples of the Modelica Standard Library with friction that sticks, rebuilt from the components of this library."""

import math
from typing import Any

import jax.numpy as jnp

from acausal import Component, Connections, Scalar, connect
from components import blocks, rotational, translational


class Friction(Component):
    """`Mechanics.Rotational.Examples.Friction`: a clutch that slips and sticks, and a brake."""

    sine: blocks.Sine
    stop: blocks.Step
    press: blocks.Step
    one: blocks.Constant
    inertia3: rotational.Inertia
    clutch: rotational.Clutch
    inertia2: rotational.Inertia
    spring: rotational.SpringDamper
    brake: rotational.Brake
    inertia1: rotational.Inertia
    product: blocks.Product = blocks.Product()
    torque: rotational.SignalTorque = rotational.SignalTorque()

    def connections(self) -> Connections:
        return (
            connect(self.sine.y, self.product.u1),
            connect(self.stop.y, self.product.u2),
            connect(self.product.y, self.torque.u),
            connect(self.torque.flange, self.inertia3.a),
            connect(self.inertia3.b, self.clutch.a),
            connect(self.one.y, self.clutch.u),
            connect(self.clutch.b, self.inertia2.a),
            connect(self.inertia2.b, self.spring.a),
            connect(self.spring.b, self.inertia1.a, self.brake.flange),
            connect(self.press.y, self.brake.u),
        )


def friction() -> Friction:
    return Friction(
        sine=blocks.Sine(amplitude=200.0, frequency=50.0 / math.pi),
        stop=blocks.Step(offset=1.0, height=-1.0, start_time=0.5),
        press=blocks.Step(height=1.0, start_time=0.5),
        one=blocks.Constant(k=1.0),
        inertia3=rotational.Inertia(J=1.0, w=100.0),
        clutch=rotational.Clutch(mu=0.5, fn_max=160.0),
        inertia2=rotational.Inertia(J=0.05, w=90.0),
        spring=rotational.SpringDamper(c=160.0, d=1.0),
        brake=rotational.Brake(mu=0.5, fn_max=1600.0),
        inertia1=rotational.Inertia(J=1.0, w=90.0),
    )


def _load(t: Scalar) -> Scalar:
    return -10.0 + 2.5 * t


class LossyGears(Component):
    """`Mechanics.Rotational.Examples.LossyGearDemo2`: a lossy gear and a bearing, stuck one by one and together."""

    sine: blocks.Sine
    load: blocks.TimeFunction
    bearing: rotational.BearingFriction
    inertia1: rotational.Inertia
    gear: rotational.LossyGear
    inertia2: rotational.Inertia
    torque1: rotational.SignalTorque = rotational.SignalTorque()
    torque2: rotational.SignalTorque = rotational.SignalTorque()

    def connections(self) -> Connections:
        return (
            connect(self.sine.y, self.torque1.u),
            connect(self.load.y, self.torque2.u),
            connect(self.torque1.flange, self.bearing.flange, self.inertia1.a),
            connect(self.inertia1.b, self.gear.a),
            connect(self.gear.b, self.inertia2.a),
            connect(self.inertia2.b, self.torque2.flange),
        )


def lossy_gears() -> LossyGears:
    return LossyGears(
        sine=blocks.Sine(amplitude=10.0, frequency=1.0),
        load=blocks.TimeFunction(function=_load),
        bearing=rotational.BearingFriction(speeds=jnp.array([0.0, 1.0]), torques=jnp.array([0.5, 1.0])),
        inertia1=rotational.Inertia(J=1.0),
        gear=rotational.LossyGear(ratio=2.0, losses=jnp.array([[0.0, 0.5, 0.5, 0.0, 0.0]])),
        inertia2=rotational.Inertia(J=1.5),
    )


class Braked(Component):
    """`Mechanics.Translational.Examples.Brake`: a mass braked to rest, against the ground and against a support."""

    press: blocks.Step
    mass1: translational.Mass
    brake1: translational.Brake
    mass2: translational.Mass
    brake2: translational.Brake
    ground: translational.Fixed = translational.Fixed()

    def connections(self) -> Connections:
        brake2 = self.brake2
        assert brake2.support is not None
        return (
            connect(self.press.y, self.brake1.u, brake2.u),
            connect(self.mass1.b, self.brake1.flange),
            connect(self.mass2.b, brake2.flange),
            connect(self.ground.flange, brake2.support),
        )


def braked() -> Braked:
    brake: dict[str, Any] = dict(mu=0.5, fn_max=1.0)
    return Braked(
        press=blocks.Step(height=2.0, start_time=0.1),
        mass1=translational.Mass(m=1.0, v=1.0),
        brake1=translational.Brake(**brake),
        mass2=translational.Mass(m=1.0, v=1.0),
        brake2=translational.Brake(**brake, support=translational.Flange()),
    )
