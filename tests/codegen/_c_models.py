"""Small models that together use every part of the C code."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Self

import jax.numpy as jnp
import numpy as np

from acausal import (
    Array,
    Component,
    Connections,
    Discrete,
    Equations,
    Events,
    Param,
    Scalar,
    Time,
    Var,
    Vector,
    at,
    connect,
    eq,
    ifelse,
    positive,
    prefer,
    refuse,
    repeat,
    shape,
    when,
)
from components import blocks, electrical, hydraulic, rotational, thermal, translational

if TYPE_CHECKING:
    Part = Any  # a wiring knows which parts it connects
else:
    Part = Component


class Rig(Component):
    """Parts in a tuple, connected by a function of them."""

    parts: tuple[Part, ...]
    wiring: Callable[..., Connections]

    def connections(self) -> Connections:
        return self.wiring(*self.parts)


def _servo(
    command: Any, control: Any, gain: Any, voltage: Any, motor: Any, gear: Any, load: Any, sensor: Any, ground: Any
) -> Connections:
    return (
        connect(command.y, control.u_s),
        connect(sensor.y, control.u_m),
        connect(control.y, gain.u),
        connect(gain.y, voltage.u),
        connect(voltage.p, motor.p),
        connect(voltage.n, motor.n, ground.p),
        connect(motor.shaft, gear.a),
        connect(gear.b, load.a),
        connect(load.b, sensor.flange),
    )


def _motor(control: Component) -> Rig:
    parts = (
        blocks.Step(height=20.0, start_time=0.01),
        control,
        blocks.Gain(k=24.0),
        electrical.SignalVoltage(),
        electrical.DCMotor(R=0.5, k=0.05, J=1e-4, L=1e-3),
        rotational.IdealGear(ratio=5.0),
        rotational.Inertia(J=0.01),
        rotational.SpeedSensor(),
        electrical.Ground(),
    )
    return Rig(parts=parts, wiring=_servo)


def motor_servo() -> Rig:
    return _motor(blocks.LimPI(k=0.1, Ti=0.1, y_max=1.0, y_min=-1.0))


def sampled_servo() -> Rig:
    return _motor(blocks.SampledPI(period=0.005, k=0.05, T=0.05, y_max=1.0, y_min=-1.0))


def _line(sine: Any, hold: Any, one: Any, three: Any) -> Connections:
    return connect(sine.y, hold.u), connect(hold.y, one.u), connect(one.y, three.u)


def sampled_line() -> Rig:
    """A sampler with delays behind it, which record after the clocks of an instant."""
    line = (blocks.SampledDelay(period=0.005), blocks.SampledDelay(period=0.005, n=3))
    sine = blocks.Sine(amplitude=1.0, frequency=7.0, phase=0.5)
    return Rig(parts=(sine, blocks.SampleHold(period=0.005), *line), wiring=_line)


def _relief(flow: Any, accumulator: Any, valve: Any, tank: Any) -> Connections:
    return connect(flow.port, accumulator.port, valve.a), connect(valve.b, tank.port)


def relief_circuit() -> Rig:
    gas = hydraulic.GasAccumulator(capacity=2e-3, resistance=1e8, volume=2.2e-3, precharge=5e6)
    valve = hydraulic.ReliefValve(conductance=1e-9, cracking_pressure=1e6)
    return Rig(parts=(hydraulic.ConstantFlow(flow=1e-4), gas, valve, hydraulic.Tank()), wiring=_relief)


def _planetary(torque: Any, rotor: Any, gearbox: Any, load: Any, damper: Any, wall: Any) -> Connections:
    return (
        connect(torque.flange, rotor.a),
        connect(rotor.b, gearbox.sun),
        connect(gearbox.carrier, load.a),
        connect(gearbox.ring, wall.flange),
        connect(load.b, damper.flange),
    )


def planetary_gear() -> Rig:
    loss = rotational.EqualMeshLoss(efficiency=0.97, transition_power=1e-3)
    parts = (
        rotational.ConstantTorque(torque=1.0),
        rotational.Inertia(J=1e-3, w=5.0),
        rotational.PlanetaryGearbox(ratio=4.0, loss=loss),
        rotational.Inertia(J=0.02),
        rotational.ViscousFriction(C=0.1),
        rotational.Fixed(),
    )
    return Rig(parts=parts, wiring=_planetary)


class Wall(Component):
    """Layers of a wall between a warm room and the cold sky."""

    layers: Array[thermal.HeatCapacitor]
    between: Array[thermal.ThermalConductor]
    room: thermal.FixedTemperature
    inside: thermal.ThermalConductor
    surface: thermal.BodyRadiation
    sky: thermal.FixedTemperature

    def connections(self) -> Connections:
        return (
            connect(self.layers[:-1].port, self.between[:].a),
            connect(self.between[:].b, self.layers[1:].port),
            connect(self.room.port, self.inside.a),
            connect(self.inside.b, self.layers[0].port),
            connect(self.sky.port, self.surface.b),
            connect(self.surface.a, self.layers[-1].port),
        )


def wall() -> Wall:
    return Wall(
        layers=repeat(thermal.HeatCapacitor(C=2e4, T=290.0), 6),
        between=repeat(thermal.ThermalConductor(G=15.0), 5),
        room=thermal.FixedTemperature(temperature=295.0),
        inside=thermal.ThermalConductor(G=8.0),
        surface=thermal.BodyRadiation(Gr=0.8),
        sky=thermal.FixedTemperature(temperature=265.0),
    )


class Bar(Component):
    """Heat conduction along a bar as an equation of arrays."""

    a: Param[Scalar, "1/s"] = 2.0
    T: Var[Vector, "K", shape(5)] = 300.0
    warm: Param[Vector, "K/s"]

    def equations(self, d: Self) -> Equations:
        T = jnp.concatenate([self.T[:1], self.T, self.T[-1:]])
        return dict(heat=eq(d.T, self.a * (T[2:] - 2.0 * T[1:-1] + T[:-2]) + self.warm))


class Offset(Component):
    """A start value of y, which a law of time ties to the state x: x = exp(-t) + s(t) up to t = 1."""

    t: Time[Scalar, "s"] = 0.0
    x: Var[Scalar, "1", prefer] = 0.0
    y: Var[Scalar, "1"] = 0.0
    s: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        law = ifelse(self.t < 1.0, 0.5 * self.t, 5.0 + 0.5 * (self.t - 1.0))
        tie, rate = eq(self.x, self.y + self.s), eq(d.x, 0.5 - self.y, check_units=False)
        return dict(law=eq(self.s, law, check_units=False), tie=tie, rate=rate)


class Ball(Component):
    """A ball that rebounds, counts its impacts, and must not fly too high."""

    g: Param[Scalar, "m/s2"] = 9.81
    e: Param[Scalar, "1", positive] = 0.8
    h: Var[Scalar, "m"] = 1.0
    v: Var[Scalar, "m/s"] = 0.0
    impacts: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(speed=eq(d.h, self.v), fall=eq(d.v, -self.g))

    def events(self) -> Events:
        return dict(
            impact=when((self.h < 0.0) & (self.v < 0.0), v=-self.e * self.v, impacts=self.impacts + 1.0),
            far=refuse(self.h > 5.0, "the ball flies away"),
        )


class Balls(Component):
    """Balls, one by one."""

    balls: tuple[Ball, ...]


class Clock(Component):
    """Single and repeated time events, one of whose times an event changes, and an `ifelse`."""

    t: Time[Scalar, "s"] = 0.0
    knee: Param[Scalar, "s"] = 0.05
    x: Var[Scalar, "s"] = 0.0
    level: Discrete[Scalar, "1"] = 0.0
    alarm: Discrete[Scalar, "s"] = 0.045
    ticks: Discrete[Vector, "", shape(3)] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(rate=eq(d.x, ifelse(self.x > self.knee, 0.5, 2.0) + self.level))

    def events(self) -> Events:
        return dict(
            ring=at(self.alarm, level=self.level + 1.0, alarm=self.alarm + 0.021),
            once=at(jnp.array([0.012, 0.031]), level=self.level - 0.5),
            tick=at(-0.01, every=0.01, check_units=False, ticks=self.ticks + jnp.array([1.0, self.level, self.x])),
        )


def _rectifier(sine: Any, source: Any, diodes: Any, capacitor: Any, load: Any, ground: Any) -> Connections:
    up, down, back, forth = diodes
    return (
        connect(sine.y, source.u),
        connect(source.p, up.p, down.n),
        connect(source.n, forth.p, back.n),
        connect(up.n, forth.n, capacitor.p, load.p),
        connect(down.p, back.p, capacitor.n, load.n, ground.p),
    )


class Bridge(Component):
    """Four ideal diodes charge a capacitor."""

    sine: blocks.Sine
    source: electrical.SignalVoltage
    up: electrical.IdealDiode
    down: electrical.IdealDiode
    back: electrical.IdealDiode
    forth: electrical.IdealDiode
    capacitor: electrical.Capacitor
    load: electrical.Resistor
    ground: electrical.Ground

    def connections(self) -> Connections:
        diodes = self.up, self.down, self.back, self.forth
        return _rectifier(self.sine, self.source, diodes, self.capacitor, self.load, self.ground)


def rectifier() -> Bridge:
    diode = electrical.IdealDiode(Ron=0.01, Goff=1e-5)
    return Bridge(
        sine=blocks.Sine(amplitude=10.0, frequency=50.0),
        source=electrical.SignalVoltage(),
        up=diode,
        down=diode,
        back=diode,
        forth=diode,
        capacitor=electrical.Capacitor(C=1e-3),
        load=electrical.Resistor(R=50.0),
        ground=electrical.Ground(),
    )


class Star(Component):
    """A source that charges many capacitors, so that its current is a sum of many flows."""

    source: electrical.ConstantVoltage
    resistors: Array[electrical.Resistor]
    capacitors: Array[electrical.Capacitor]
    ground: electrical.Ground

    def connections(self) -> Connections:
        return (
            connect(self.source.p, self.resistors[:].p),
            connect(self.resistors[:].n, self.capacitors[:].p),
            connect(self.capacitors[:].n, self.source.n, self.ground.p),
        )


def star(n: int = 20) -> Star:
    return Star(
        source=electrical.ConstantVoltage(V=5.0),
        resistors=repeat(electrical.Resistor(R=jnp.linspace(1.0, 3.0, n)), n),
        capacitors=repeat(electrical.Capacitor(C=jnp.linspace(1.0, 2.0, n)), n),
        ground=electrical.Ground(),
    )


def _divider(source: Any, r: Any, diode: Any, ballast: Any, c: Any, ground: Any) -> Connections:
    return (
        connect(source.p, r.p),
        connect(r.n, diode.p),
        connect(diode.n, ballast.p),
        connect(ballast.n, c.p),
        connect(c.n, source.n, ground.p),
    )


def nonlinear_block() -> Rig:
    """A current that follows from the law of a diode between resistors."""
    diode = electrical.Diode(Ids=1e-9)
    parts = (
        electrical.ConstantVoltage(V=5.0),
        electrical.Resistor(R=100.0),
        diode,
        electrical.Resistor(R=20.0),
        electrical.Capacitor(C=1e-3),
        electrical.Ground(),
    )
    return Rig(parts=parts, wiring=_divider)


def _slider(force: Any, actuator: Any, mass: Any) -> Connections:
    return connect(force.y, actuator.u), connect(actuator.flange, mass.a)


def stick_slip() -> Rig:
    """A mass with dry friction between stops, pushed to and fro."""
    mass = translational.MassWithStopAndFriction(m=1.0, s_min=-0.05, s_max=0.05, F_Coulomb=2.0, F_Stribeck=1.0)
    parts = (blocks.Sine(amplitude=5.0, frequency=2.0), translational.SignalForce(), mass)
    return Rig(parts=parts, wiring=_slider)


class Striker(Component):
    """A mass that strikes a wall and drives a rotor through a crank: a nonlinear constraint ties their speeds."""

    m: Param[Scalar, "kg"] = 2.0
    J: Param[Scalar, "kg.m2"] = 0.5
    r: Param[Scalar, "m"] = 0.3
    s: Var[Scalar, "m"] = 0.15
    v: Var[Scalar, "m/s"] = 0.0
    phi: Var[Scalar, "rad", prefer] = 0.45
    w: Var[Scalar, "rad/s", prefer] = -3.0
    f: Var[Scalar, "N"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(
            crank=eq(self.s, self.r * jnp.sin(self.phi)),
            speed=eq(self.v, d.s),
            turns=eq(self.w, d.phi),
            newton=eq(self.m * d.v, self.f),
            euler=eq(self.J * d.w, -self.f * self.r * jnp.cos(self.phi)),
        )

    def events(self) -> Events:
        return dict(strikes=when((self.s < 0.14) & (self.v < 0.0), v=-0.5 * self.v))


def _spring(table: Any, mass: Any) -> Connections:
    return (connect(table.flange, mass.a),)


def tabulated_spring() -> Rig:
    positions = np.array([-0.1, -0.02, 0.0, 0.03, 0.1])
    spring = translational.TabulatedSpring(positions=positions, forces=positions * 100.0 + 2e3 * positions**3)
    return Rig(parts=(spring, translational.Mass(m=0.5, v=0.2, s=0.01)), wiring=_spring)


def _strikes(
    striker: Any, first: Any, lever: Any, second: Any, third: Any, middle: Any, stuck: Any, stop: Any
) -> Connections:
    return (
        connect(striker.b, first.a),
        connect(first.b, lever.a),
        connect(lever.b, second.a),
        connect(third.b, middle.a),
        connect(middle.b, second.a),
        connect(third.a, stuck.flange, stop.flange),
    )


def contacts() -> Rig:
    """A mass strikes a lever, whose other end presses a mass in closed contact against one that sticks, at the start;
    the last one reaches a stop later.
    """
    parts = (
        translational.Mass(m=2.0, s=1e-6, v=3.0),
        translational.RigidContact(restitution=0.7),
        translational.Lever(arm_a=0.2, arm_b=0.5),
        translational.Mass(m=0.7, s=0.0),
        translational.Mass(m=1.5, s=0.0),
        translational.RigidContact(mode=-1.0),
        translational.StribeckFriction(Fc=0.5, Fs=0.8, vs=0.1),
        translational.HardStop(s_min=-0.2, restitution=0.4),
    )
    return Rig(parts=parts, wiring=_strikes)


MODELS: dict[str, Callable[[], Component]] = {
    "motor servo": motor_servo,
    "sampled servo": sampled_servo,
    "sampled line": sampled_line,
    "relief circuit": relief_circuit,
    "planetary gear": planetary_gear,
    "wall": wall,
    "bar": lambda: Bar(warm=np.arange(5.0)),
    "ball": Ball,
    "clock": Clock,
    "rectifier": rectifier,
    "nonlinear block": nonlinear_block,
    "star": star,
    "stick-slip": stick_slip,
    "tabulated spring": tabulated_spring,
    "striker": Striker,
    "struck train": contacts,
}
