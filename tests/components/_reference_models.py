"""Examples of the Modelica Standard Library, rebuilt from the components of this library."""

import math
from typing import Any

from acausal import Component, Connections, connect
from components import blocks, electrical, rotational, thermal, translational


class First(Component):
    """`Mechanics.Rotational.Examples.First`: a geared drive with elasticity, damped at the gear."""

    sine: blocks.Sine
    motor: rotational.Inertia
    gear: rotational.IdealGear
    inertia2: rotational.Inertia
    spring: rotational.Spring
    inertia3: rotational.Inertia
    damper: rotational.Damper
    torque: rotational.SignalTorque = rotational.SignalTorque()
    fixed: rotational.Fixed = rotational.Fixed()

    def connections(self) -> Connections:
        return (
            connect(self.sine.y, self.torque.u),
            connect(self.torque.flange, self.motor.a),
            connect(self.motor.b, self.gear.a),
            connect(self.gear.b, self.inertia2.a),
            connect(self.inertia2.b, self.spring.a, self.damper.a),
            connect(self.spring.b, self.inertia3.a),
            connect(self.damper.b, self.fixed.flange),
        )


def first() -> First:
    return First(
        sine=blocks.Sine(amplitude=10.0, frequency=5.0),
        motor=rotational.Inertia(J=0.1),
        gear=rotational.IdealGear(ratio=10.0),
        inertia2=rotational.Inertia(J=2.0),
        spring=rotational.Spring(c=1e4),
        inertia3=rotational.Inertia(J=2.0),
        damper=rotational.Damper(d=10.0),
    )


class Accelerate(Component):
    """`Mechanics.Translational.Examples.Accelerate`: inverse dynamics of a mass."""

    constant: blocks.Constant
    mass: translational.SlidingMass
    accelerate: translational.SignalAcceleration = translational.SignalAcceleration()

    def connections(self) -> Connections:
        return connect(self.constant.y, self.accelerate.u), connect(self.accelerate.flange, self.mass.a)


def accelerate() -> Accelerate:
    return Accelerate(constant=blocks.Constant(k=1.0), mass=translational.SlidingMass(m=1.0, L=1.0, s=0.5))


class Oscillator(Component):
    """`Mechanics.Translational.Examples.Oscillator`: a mass on a spring, with and without damper, in resonance."""

    sine: blocks.Sine
    mass1: translational.SlidingMass
    spring1: translational.Spring
    mass2: translational.SlidingMass
    spring2: translational.SpringDamper
    rod: translational.Rod
    wall: translational.Fixed = translational.Fixed()
    force1: translational.SignalForce = translational.SignalForce()
    force2: translational.SignalForce = translational.SignalForce()

    def connections(self) -> Connections:
        return (
            connect(self.sine.y, self.force1.u, self.force2.u),
            connect(self.force1.flange, self.mass1.a),
            connect(self.mass1.b, self.spring1.a),
            connect(self.force2.flange, self.mass2.a),
            connect(self.mass2.b, self.spring2.a),
            connect(self.spring1.b, self.spring2.b, self.rod.b),
            connect(self.rod.a, self.wall.flange),
        )


def oscillator() -> Oscillator:
    return Oscillator(
        sine=blocks.Sine(amplitude=1.0, frequency=15.9155),
        mass1=translational.SlidingMass(m=1.0, L=1.0, s=-0.5),
        spring1=translational.Spring(c=1e4, s_rel0=1.0),
        mass2=translational.SlidingMass(m=1.0, L=1.0, s=-0.5),
        spring2=translational.SpringDamper(c=1e4, d=10.0, s_rel0=1.0),
        rod=translational.Rod(L=1.0),
    )


class Braking(Component):
    """`Mechanics.Rotational.Examples.EddyCurrentBrake`: the rotor's energy heats the brake."""

    inertia: rotational.Inertia
    brake: rotational.EddyCurrentBrake
    capacitor: thermal.HeatCapacitor

    def connections(self) -> Connections:
        return (
            connect(self.inertia.b, self.brake.flange),
            connect(self.brake.heat, self.capacitor.port),
        )


def braking() -> Braking:
    return Braking(
        inertia=rotational.Inertia(J=1.0, w=20.0),
        brake=rotational.EddyCurrentBrake(tau_nominal=100.0, w_nominal=10.0),
        capacitor=thermal.HeatCapacitor(C=1.0, T=293.15),
    )


class MotorStart(Component):
    """`Electrical.Machines.Examples.DCMachines.DCPM_Start`: a voltage ramp, then a step of the load."""

    ramp: blocks.Ramp
    motor: electrical.DCMotor
    inertia: rotational.Inertia
    step: blocks.Step
    source: electrical.SignalVoltage = electrical.SignalVoltage()
    ground: electrical.Ground = electrical.Ground()
    load: rotational.SignalTorque = rotational.SignalTorque()

    def connections(self) -> Connections:
        return (
            connect(self.ramp.y, self.source.u),
            connect(self.source.p, self.motor.p),
            connect(self.source.n, self.motor.n, self.ground.p),
            connect(self.motor.shaft, self.inertia.a),
            connect(self.inertia.b, self.load.flange),
            connect(self.step.y, self.load.u),
        )


def motor_start() -> MotorStart:
    k = (100.0 - 0.05 * 100.0) / (1425.0 * 2.0 * math.pi / 60.0)
    return MotorStart(
        ramp=blocks.Ramp(height=100.0, duration=0.8, start_time=0.2),
        motor=electrical.DCMotor(R=0.05, L=1.5e-3, k=k, J=0.15),
        inertia=rotational.Inertia(J=0.15),
        step=blocks.Step(height=-63.66, start_time=1.5),
    )


class Saturation(Component):
    """`Electrical.Analog.Examples.ShowSaturatingInductor`: a plain and a saturating coil on one source."""

    sine: blocks.Sine
    inductance: electrical.Inductor
    saturating: electrical.SaturatingInductor
    source: electrical.SignalVoltage = electrical.SignalVoltage()
    ground: electrical.Ground = electrical.Ground()

    def connections(self) -> Connections:
        return (
            connect(self.sine.y, self.source.u),
            connect(self.source.p, self.inductance.p, self.saturating.p),
            connect(self.source.n, self.inductance.n, self.saturating.n, self.ground.p),
        )


def saturation() -> Saturation:
    return Saturation(
        sine=blocks.Sine(amplitude=1.25, frequency=1.0 / (2.0 * math.pi), phase=math.pi / 2.0),
        inductance=electrical.Inductor(L=1.0),
        saturating=electrical.SaturatingInductor(Lnom=1.0, Inom=1.0, Lzer=2.0, Linf=0.5),
    )


class Backlash(Component):
    """`Mechanics.Rotational.Examples.Backlash`: an oscillator with play, and one without."""

    spring: rotational.SpringDamper
    inertia1: rotational.Inertia
    backlash: rotational.ElastoBacklash
    inertia2: rotational.Inertia
    fixed: rotational.Fixed = rotational.Fixed()

    def connections(self) -> Connections:
        return (
            connect(self.fixed.flange, self.spring.a, self.backlash.a),
            connect(self.spring.b, self.inertia1.a),
            connect(self.backlash.b, self.inertia2.a),
        )


def backlash() -> Backlash:
    start = rotational.Flange(phi=0.5 * math.pi)
    return Backlash(
        spring=rotational.SpringDamper(c=20e3, d=50.0),
        inertia1=rotational.Inertia(J=5.0, a=start),
        backlash=rotational.ElastoBacklash(c=20e3, d=50.0, play=0.25 * math.pi),
        inertia2=rotational.Inertia(J=5.0, a=start),
    )


class Gaps(Component):
    """`Mechanics.Translational.Examples.ElastoGap`: a mass between two stops, and one between two springs."""

    rod1: translational.Rod
    rod2: translational.Rod
    spring1: translational.SpringDamper
    mass1: translational.SlidingMass
    spring2: translational.SpringDamper
    gap1: translational.ElastoGap
    mass2: translational.SlidingMass
    gap2: translational.ElastoGap
    fixed: translational.Fixed = translational.Fixed()

    def connections(self) -> Connections:
        return (
            connect(self.rod1.b, self.fixed.flange, self.rod2.a),
            connect(self.rod1.a, self.spring1.a, self.gap1.a),
            connect(self.rod2.b, self.spring2.b, self.gap2.b),
            connect(self.spring1.b, self.mass1.a),
            connect(self.mass1.b, self.spring2.a),
            connect(self.gap1.b, self.mass2.a),
            connect(self.mass2.b, self.gap2.a),
        )


def gaps() -> Gaps:
    given: list[dict[str, Any]] = [dict(c=10.0, d=1.5, s_rel0=s_rel0) for s_rel0 in (1.0, 1.5)]
    spring, gap = given
    return Gaps(
        rod1=translational.Rod(L=2.0),
        rod2=translational.Rod(L=2.0),
        spring1=translational.SpringDamper(**spring),
        mass1=translational.SlidingMass(m=1.0, s=2.0),
        spring2=translational.SpringDamper(**spring),
        gap1=translational.ElastoGap(**gap),
        mass2=translational.SlidingMass(m=1.0, s=2.0),
        gap2=translational.ElastoGap(**gap),
    )


class LoadedMotor(Component):
    """The motor of ModelingToolkitStandardLibrary's `multi_domain` test, from its parts."""

    step: blocks.Step
    resistor: electrical.Resistor
    inductor: electrical.Inductor
    emf: electrical.EMF
    inertia: rotational.Inertia
    friction: rotational.Damper
    load_step: blocks.Step
    source: electrical.SignalVoltage = electrical.SignalVoltage()
    ground: electrical.Ground = electrical.Ground()
    load: rotational.SignalTorque = rotational.SignalTorque()
    fixed: rotational.Fixed = rotational.Fixed()

    def connections(self) -> Connections:
        return (
            connect(self.step.y, self.source.u),
            connect(self.source.p, self.resistor.p),
            connect(self.resistor.n, self.inductor.p),
            connect(self.inductor.n, self.emf.p),
            connect(self.emf.n, self.source.n, self.ground.p),
            connect(self.emf.shaft, self.inertia.a, self.friction.b),
            connect(self.friction.a, self.fixed.flange),
            connect(self.load_step.y, self.load.u),
            connect(self.inertia.b, self.load.flange),
        )


def loaded_motor() -> LoadedMotor:
    return LoadedMotor(
        step=blocks.Step(height=10.0),
        resistor=electrical.Resistor(R=0.5),
        inductor=electrical.Inductor(L=4.5e-3),
        emf=electrical.EMF(k=0.5),
        inertia=rotational.Inertia(J=0.02),
        friction=rotational.Damper(d=0.01),
        load_step=blocks.Step(height=-3.0, start_time=3.0),
    )
