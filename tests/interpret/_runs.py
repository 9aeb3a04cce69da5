"""Runs of small models that together take every way through a run."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Self

import jax.numpy as jnp
import numpy as np
import pytest

from acausal import (
    Component,
    Connections,
    Discrete,
    Equations,
    Events,
    Param,
    Scalar,
    Solution,
    Time,
    Var,
    Vector,
    at,
    connect,
    eq,
    ifelse,
    prefer,
    repeat,
    shape,
    simulate,
    when,
)
from acausal._evaluate.building import system_of
from acausal._integrate.setup import pattern
from components import blocks, electrical, rotational, thermal, translational

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


def _charge(source: Any, r: Any, c: Any, ground: Any) -> Connections:
    return connect(source.p, r.p), connect(r.n, c.p), connect(c.n, source.n, ground.p)


def charged(V: Any = 5.0) -> Rig:
    """A capacitor charged through a resistor: v = V (1 - exp(-t / 0.1 s))."""
    parts = electrical.ConstantVoltage(V=V), electrical.Resistor(R=100.0), electrical.Capacitor(C=1e-3)
    return Rig(parts=(*parts, electrical.Ground()), wiring=_charge)


class Ball(Component):
    """A ball that rebounds from the floor, and counts its impacts."""

    e: Param[Scalar, "1"] = 0.7
    h: Var[Scalar, "m"] = 1.0
    v: Var[Scalar, "m/s"] = 0.0
    impacts: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(speed=eq(d.h, self.v), fall=eq(d.v, -9.81, check_units=False))

    def events(self) -> Events:
        return dict(impact=when(self.h < 0.0, v=-self.e * self.v, impacts=self.impacts + 1.0))


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
            once=at(jnp.array([0.012, 0.031]), level=self.level + 0.5),
            tick=at(-0.01, every=0.01, check_units=False, ticks=self.ticks + jnp.array([1.0, self.level, self.x])),
        )


class Pendulum(Component):
    """A mass on a rod in Cartesian coordinates, which turns over: index 3."""

    x: Var[Scalar, "m"] = 1.0
    y: Var[Scalar, "m"] = 0.0
    u: Var[Scalar, "m/s"] = 0.0
    v: Var[Scalar, "m/s"] = -5.0
    force: Var[Scalar, "1/s2"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(
            speed_x=eq(self.u, d.x),
            speed_y=eq(self.v, d.y),
            newton_x=eq(d.u, -self.force * self.x),
            newton_y=eq(d.v, -self.force * self.y - 9.81, check_units=False),
            rod=eq(self.x**2 + self.y**2, 1.0, check_units=False),
        )


class Struck(Component):
    """A mass that strikes a wall and drives a rotor by a rope."""

    m: Param[Scalar, "kg"] = 2.0
    J: Param[Scalar, "kg.m2"] = 0.5
    r: Param[Scalar, "m"] = 0.3
    s: Var[Scalar, "m"] = 0.15
    v: Var[Scalar, "m/s"] = -0.9
    phi: Var[Scalar, "rad", prefer] = 0.5
    w: Var[Scalar, "rad/s", prefer] = -3.0
    f: Var[Scalar, "N"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(
            rope=eq(self.s, self.r * self.phi),
            speed=eq(self.v, d.s),
            turns=eq(self.w, d.phi),
            newton=eq(self.m * d.v, self.f),
            euler=eq(self.J * d.w, -self.f * self.r),
        )

    def events(self) -> Events:
        return dict(strikes=when((self.s < 0.14) & (self.v < 0.0), v=-0.5 * self.v))


class Lag(Component):
    """A lag whose start is an equation of its rate."""

    k: Param[Scalar, ""] = 2.0
    x: Var[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(lag=eq(d.x, 3.0 * (self.k - self.x - 0.1 * self.x**3)))

    def initial_equations(self, d: Self) -> Equations:
        return dict(rising=eq(d.x, 1.0))


class Coupled(Component):
    """States whose rates solve a linear system, and a function of them in another precision."""

    A: Param[Vector, "s"]
    x: Var[Vector, "1", shape(3)] = 1.0

    def equations(self, d: Self) -> Equations:
        small = (self.x.astype(np.float32) * np.float32(0.5)).astype(float)
        return dict(decay=eq(jnp.linalg.solve(self.A, d.x), small - self.x, check_units=False))


def _push(force: Any, actuator: Any, mass: Any) -> Connections:
    return connect(force.y, actuator.u), connect(actuator.flange, mass.a)


def stick_slip() -> Rig:
    """A mass with dry friction between stops, pushed to and fro."""
    mass = translational.MassWithStopAndFriction(m=1.0, s_min=-0.05, s_max=0.05, F_Coulomb=2.0, F_Stribeck=1.0)
    parts = (blocks.Sine(amplitude=5.0, frequency=2.0), translational.SignalForce(), mass)
    return Rig(parts=parts, wiring=_push)


def _loop(gain: Any, integrator: Any, delay: Any) -> Connections:
    return connect(gain.y, integrator.u), connect(integrator.y, delay.u), connect(delay.y, gain.u)


def delayed() -> Rig:
    parts = blocks.Gain(k=-1.0), blocks.Integrator(x=1.0), blocks.FixedDelay(T=0.2)
    return Rig(parts=parts, wiring=_loop)


def _rectifies(source: Any, r: Any, diode: Any, ballast: Any, c: Any, ground: Any) -> Connections:
    across = connect(source.p, r.p), connect(r.n, diode.p), connect(diode.n, ballast.p)
    return *across, connect(ballast.n, c.p), connect(c.n, source.n, ground.p)


def nonlinear_block() -> Rig:
    """A current that follows from the law of a diode between resistors."""
    parts = (
        electrical.ConstantVoltage(V=5.0),
        electrical.Resistor(R=100.0),
        electrical.Diode(Ids=1e-9),
        electrical.Resistor(R=20.0),
        electrical.Capacitor(C=1e-3),
        electrical.Ground(),
    )
    return Rig(parts=parts, wiring=_rectifies)


def _sampled(sine: Any, hold: Any, one: Any, three: Any) -> Connections:
    return connect(sine.y, hold.u), connect(hold.y, one.u), connect(one.y, three.u)


def sampled() -> Rig:
    line = blocks.SampledDelay(period=0.005), blocks.SampledDelay(period=0.005, n=3)
    sine = blocks.Sine(amplitude=1.0, frequency=7.0, phase=0.5)
    return Rig(parts=(sine, blocks.SampleHold(period=0.005), *line), wiring=_sampled)


def _layers(room: Any, inside: Any, layers: Any, between: Any) -> Connections:
    return (
        connect(room.port, inside.a),
        connect(inside.b, layers[0].port),
        connect(layers[:-1].port, between[:].a),
        connect(between[:].b, layers[1:].port),
    )


def wall() -> Rig:
    parts = (
        thermal.FixedTemperature(temperature=295.0),
        thermal.ThermalConductor(G=8.0),
        repeat(thermal.HeatCapacitor(C=2e4, T=290.0), 12),
        repeat(thermal.ThermalConductor(G=15.0), 11),
    )
    return Rig(parts=parts, wiring=_layers)


def sparse() -> Solution[Rig]:
    """A run with sparse steps, though its model is small."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pattern, "LARGEST_INVERSE", 0)
        patch.setattr(pattern, "SERIAL", 1e-6)
        pattern.pattern_of_rates.cache_clear()
        model = wall()
        assert pattern.pattern_of_rates(system_of(model)) is not None
        solution = simulate(model, 1e4, save="end")
    pattern.pattern_of_rates.cache_clear()
    return solution


def _turns(torque: Any, rotor: Any, gearbox: Any, load: Any, damper: Any, fixed: Any) -> Connections:
    ends = connect(torque.flange, rotor.a), connect(rotor.b, gearbox.sun), connect(gearbox.carrier, load.a)
    return *ends, connect(gearbox.ring, fixed.flange), connect(load.b, damper.flange)


def gearbox() -> Rig:
    loss = rotational.EqualMeshLoss(efficiency=0.97, transition_power=1e-3)
    parts = (
        rotational.ConstantTorque(torque=1.0),
        rotational.Inertia(J=1e-3, w=5.0),
        rotational.PlanetaryGearbox(ratio=4.0, loss=loss),
        rotational.Inertia(J=0.02),
        rotational.ViscousFriction(C=0.1),
        rotational.Fixed(),
    )
    return Rig(parts=parts, wiring=_turns)


def _spring(table: Any, mass: Any) -> Connections:
    return (connect(table.flange, mass.a),)


def tabulated_spring() -> Rig:
    positions = np.array([-0.1, -0.02, 0.0, 0.03, 0.1])
    spring = translational.TabulatedSpring(positions=positions, forces=positions * 100.0 + 2e3 * positions**3)
    return Rig(parts=(spring, translational.Mass(m=0.5, v=0.2, s=0.01)), wiring=_spring)


def integrals(s: Any) -> Any:
    return dict(v=s.parts[2].v)


RUNS: dict[str, Callable[[], Solution[Any]]] = {
    "circuit": lambda: simulate(charged(), 0.3),
    "until": lambda: simulate(charged(), 1.0, until=lambda s: s.parts[2].v - 2.0, integrals=integrals, rtol=1e-8),
    "saved": lambda: simulate(charged(), 0.3, save=[0.0, 0.02, 0.1], peaks=lambda s: s.parts[1].p.i),
    "dense": lambda: simulate(charged(), 0.3, save="dense", dt0=1e-3, energy=True),
    "rebounds": lambda: simulate(Ball(), 1.5),
    "clock": lambda: simulate(Clock(), 0.1),
    "sampled": lambda: simulate(sampled(), 0.1, save=np.linspace(0.0, 0.1, 7)),
    "friction": lambda: simulate(stick_slip(), 0.5),
    "impact": lambda: simulate(Struck(), 0.1),
    "delay": lambda: simulate(delayed(), 1.0),
    "sparse": sparse,
    "nonlinear block": lambda: simulate(nonlinear_block(), 0.2),
    "initial equations": lambda: simulate(Lag(), 1.0),
    "pendulum": lambda: simulate(Pendulum(), 1.0),
    "linear system": lambda: simulate(Coupled(A=jnp.diag(jnp.array([1.0, 2.0, 3.0]))), 1.0),
    "gearbox": lambda: simulate(gearbox(), 0.2),
    "table": lambda: simulate(tabulated_spring(), 0.3),
}
