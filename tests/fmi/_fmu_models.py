"""Models of the tests of FMUs."""

from typing import Any, Self

from acausal import (
    Component,
    Connections,
    Discrete,
    Equations,
    Events,
    Param,
    Scalar,
    Var,
    Vector,
    at,
    connect,
    eq,
    positive,
    when,
)
from components.blocks import Gain, Input, Output, Sine
from components.rotational import Inertia, SignalSpeed, SignalTorque, SpeedSensor


class Bouncer(Component):
    """A ball that rebounds from the floor with a share e of its speed."""

    e: Param[Scalar, "1", positive]  # restitution
    g: Param[Scalar, "m/s2", positive] = 9.81  # gravity
    h: Var[Scalar, "m"] = 1.0  # height
    v: Var[Scalar, "m/s"] = 0.0  # speed upwards
    impacts: Discrete[Scalar, "1"] = 0.0  # so far

    def equations(self, d: Self) -> Equations:
        return dict(speed=eq(d.h, self.v), fall=eq(d.v, -self.g))

    def events(self) -> Events:
        return dict(impact=when(self.h < 0.0, v=-self.e * self.v, impacts=self.impacts + 1.0))


class Forced(Component):
    """A van der Pol oscillator with a force u and an output of its power."""

    mu: Param[Scalar, "1", positive] = 1.0
    x: Var[Scalar, "1"] = 2.0
    v: Var[Scalar, "1/s"] = 0.0
    u: Input = Input()
    power: Output = Output()

    def equations(self, d: Self) -> Equations:
        force = self.mu * (1.0 - self.x**2) * self.v - self.x + self.u.value
        return dict(
            speed=eq(d.x, self.v),
            force=eq(d.v, force, check_units=False),
            power=eq(self.power.value, self.u.value * self.v, check_units=False),
        )


class Latch(Component):
    """It counts how often the state x and the input u become low."""

    x: Var[Scalar, "1"] = -1.0
    u: Input = Input()
    low_state: Discrete[Scalar, "1"] = 0.0
    low_input: Discrete[Scalar, "1"] = 0.0
    total: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(still=eq(d.x), total=eq(self.total.value, self.low_state + self.low_input))

    def events(self) -> Events:
        return dict(
            state=when(self.x < 0.0, low_state=self.low_state + 1.0),
            input=when(self.u.value < 1.0, low_input=self.low_input + 1.0),
        )


class Reciprocal(Component):
    """A rate 1 / u, and an output on which u has no influence."""

    x: Var[Scalar, "1"] = 1.0
    u: Input = Input()
    twice: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(rate=eq(d.x, 1.0 / self.u.value, check_units=False), twice=eq(self.twice.value, 2.0 * self.x))


class Inverters(Component):
    """Two inverters in series, without states."""

    first: Gain
    second: Gain

    def connections(self) -> Connections:
        return (connect(self.first.y, self.second.u),)


class Driven(Component):
    """An oscillator that a sine drives."""

    source: Sine
    oscillator: Component

    def connections(self) -> Connections:
        oscillator: Any = self.oscillator
        return (connect(self.source.y, oscillator.u),)


class Turned(Component):
    """A rotor whose speed is prescribed, so that its equations need the acceleration."""

    source: SignalSpeed = SignalSpeed()
    rotor: Inertia

    def connections(self) -> Connections:
        return (connect(self.source.flange, self.rotor.a),)


class Measured(Component):
    """A torque from outside turns an inertia, whose speed is measured."""

    scale: Param[Scalar, "1", positive] = 2.0  # of the torque
    marks: Param[Vector, "m"] = (1.0, 2.0)  # a mark and another
    torque: SignalTorque = SignalTorque()
    inertia: Inertia
    speed: SpeedSensor = SpeedSensor()

    def connections(self) -> Connections:
        return (connect(self.torque.flange, self.inertia.a, self.speed.flange),)


class Clocked(Component):
    """A model without states that counts the seconds."""

    count: Discrete[Scalar, "1"] = 0.0
    y: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(y=eq(self.y, self.count))

    def events(self) -> Events:
        return dict(tick=at(0.0, every=1.0, count=self.count + 1.0))
