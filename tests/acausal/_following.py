"""Models whose discrete variables follow values, as those of Modelica do with pre(...)."""

from typing import Self

import jax.numpy as jnp

from acausal import (
    Array,
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
    ifelse,
    shape,
    when,
)
from acausal._declare.component import follow, started
from acausal._numbers import Truth
from components import blocks, translational
from components.translational import Flange

FORWARD, STUCK, BACKWARD, UNKNOWN = 1.0, 0.0, -1.0, 3.0


def truth(condition: Truth) -> Truth:
    """A relation that generates events, as a truth value."""
    return ifelse(condition, 1.0, 0.0) > 0.5


def number(condition: Truth | int) -> Scalar:
    return jnp.where(condition, 1.0, 0.0)


class Chain(Component):
    """Three modes advance one after the other, in one instant at 0.5 s, each because of the one before.

    `late` becomes 1 if values are taken over before the relation between them is up to date.
    """

    time: Var[Scalar, ""] = 0.0
    a: Var[Scalar, ""] = 0.0
    b: Var[Scalar, ""] = 0.0
    c: Var[Scalar, ""] = 0.0
    late: Var[Scalar, ""] = 0.0
    first: Var[Scalar, ""] = 0.0
    last_a: Discrete[Scalar, ""] = 0.0
    last_b: Discrete[Scalar, ""] = 0.0
    last_c: Discrete[Scalar, ""] = 0.0
    last_late: Discrete[Scalar, ""] = 0.0
    rounds: Discrete[Scalar, ""] = 0.0
    initial: Discrete[Scalar, ""] = 1.0
    at_start: Discrete[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        was_low = truth(self.last_a < 0.5)
        return dict(
            time=eq(d.time, 1.0),
            a=eq(self.a, jnp.where(truth(self.time > 0.5), 1.0, self.last_a)),
            b=eq(self.b, jnp.where(self.last_a > 0.5, 2.0, self.last_b)),
            c=eq(self.c, jnp.where(self.last_b > 0.5, self.last_b + 1.0, self.last_c)),
            late=eq(self.late, jnp.where(was_low & (self.last_a > 0.5), 1.0, self.last_late)),
            first=eq(self.first, jnp.where(self.initial != 0.0, self.time + 5.0, self.at_start)),
        )

    def events(self) -> Events:
        modes = dict(last_a=self.a, last_b=self.b, last_c=self.c, last_late=self.late, at_start=self.first)
        is_new = (self.last_a != self.a) | (self.last_b != self.b) | (self.last_c != self.c)
        return dict(_last=follow(**modes), _start=started(initial=0.0), _count=follow(rounds=self.rounds + is_new))


class Friction(Component):
    """Dry friction with the equations of Modelica's `PartialFriction` (Otter, Elmqvist, Mattsson, CACSD 1999).

    The friction force is Fc + (Fs - Fc) exp(-(v/vs)^2) while it slides, up to Fs while it sticks.
    """

    Fc: Param[Scalar, ""]
    Fs: Param[Scalar, ""]
    vs: Param[Scalar, ""]
    v: Var[Scalar, ""] = 0.0
    a: Var[Scalar, ""] = 0.0
    s: Var[Scalar, ""] = 0.0  # path parameter
    f: Var[Scalar, ""] = 0.0
    mode: Var[Scalar, ""] = 0.0
    forward: Var[Scalar, ""] = 0.0  # starts to slide forward
    backward: Var[Scalar, ""] = 0.0
    locked: Var[Scalar, ""] = 0.0
    last_mode: Discrete[Scalar, ""] = UNKNOWN
    last_forward: Discrete[Scalar, ""] = 0.0
    last_backward: Discrete[Scalar, ""] = 0.0
    initial: Discrete[Scalar, ""] = 1.0
    flange: Flange = Flange()

    def equations(self, d: Self) -> Equations:
        s, v, last = self.s, self.v, self.last_mode
        small = 1e-3
        is_initial = self.initial != 0.0
        f0 = self._sliding(0.0)
        up, down = self.forward != 0.0, self.backward != 0.0
        is_forward, is_backward, locked = last == FORWARD, last == BACKWARD, self.locked != 0.0
        starts_forward = (last == STUCK) & (truth(s > self.Fs) | (self.last_forward != 0.0) & truth(s > f0))
        starts_forward |= is_backward & truth(v > small) | is_initial & truth(v > 0.0)
        starts_backward = (last == STUCK) & (truth(s < -self.Fs) | (self.last_backward != 0.0) & truth(s < -f0))
        starts_backward |= is_forward & truth(v < -small) | is_initial & truth(v < 0.0)
        mode = jnp.where(
            (is_forward | up) & truth(v > 0.0),
            FORWARD,
            jnp.where((is_backward | down) & truth(v < 0.0), BACKWARD, STUCK),
        )
        is_up = up | ~down & is_forward
        return dict(
            speed=eq(v, d.flange.s, check_units=False),
            acceleration=eq(self.a, d.v),
            mode=eq(self.mode, mode),
            forward=eq(self.forward, number(starts_forward)),
            backward=eq(self.backward, number(starts_backward)),
            locked=eq(self.locked, number(~(is_forward | up | is_backward | down))),
            path=eq(self.a, jnp.where(locked, 0.0, jnp.where(is_up, s - self.Fs, s + self.Fs))),
            force=eq(self.f, jnp.where(locked, s, jnp.where(is_up, self._sliding(v), -self._sliding(-v)))),
            flange=eq(self.flange.f, self.f, check_units=False),
        )

    def _sliding(self, speed: Scalar) -> Scalar:
        return self.Fc + (self.Fs - self.Fc) * jnp.exp(-((speed / self.vs) ** 2))

    def events(self) -> Events:
        last = dict(last_mode=self.mode, last_forward=self.forward, last_backward=self.backward)
        return dict(
            _last=follow(**last),
            _start=started(initial=0.0),
            hold=when(self.locked > 0.5),
            slide=when(self.locked < 0.5),
        )


class Plant(Component, partial=True):
    """A first-order plant under a sampled PI controller; `integral` and u are those of the controller."""

    kp: Param[Scalar, ""]
    ki: Param[Scalar, ""]
    period: Param[Scalar, ""] = 0.1
    x: Var[Scalar, ""] = 0.0

    def stepped(self, integral: Scalar) -> dict[str, Scalar]:
        error = 1.0 - self.x
        new = integral + self.period * self.ki * error
        return dict(integral=new, u=self.kp * error + new)


class Written(Plant):
    integral: Discrete[Scalar, ""] = 0.0
    u: Discrete[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(plant=eq(d.x, self.u - self.x))

    def events(self) -> Events:
        return dict(tick=at(0.0, every=self.period, **self.stepped(self.integral)))


class Followed(Plant):
    """The controller as equations that hold in the instants in which a clock counts, as Modelica's when-equations."""

    integral: Var[Scalar, ""] = 0.0
    u: Var[Scalar, ""] = 0.0
    n: Discrete[Scalar, ""] = 0.0
    last_n: Discrete[Scalar, ""] = 0.0
    last_integral: Discrete[Scalar, ""] = 0.0
    last_u: Discrete[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        ticks, new = self.n != self.last_n, self.stepped(self.last_integral)
        return dict(
            plant=eq(d.x, self.u - self.x),
            integral=eq(self.integral, jnp.where(ticks, new["integral"], self.last_integral)),
            u=eq(self.u, jnp.where(ticks, new["u"], self.last_u)),
        )

    def events(self) -> Events:
        return dict(
            tick=at(0.0, every=self.period, n=self.n + 1.0),
            _last=follow(last_n=self.n, last_integral=self.integral, last_u=self.u),
        )


class Counters(Component):
    """Each element advances by 1 in each round up to its limit, from a time on; `bad` is a value that becomes NaN."""

    since: Param[Scalar, ""]
    limits: Param[Vector, "", shape(2)]
    time: Var[Scalar, ""] = 0.0
    n: Var[Vector, "", shape(2)] = 0.0
    last: Discrete[Vector, "", shape(2)] = 0.0
    bad: Discrete[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        goes = truth(self.time > self.since) & (self.last < self.limits)
        return dict(time=eq(d.time, 1.0), n=eq(self.n, self.last + number(goes)))

    def events(self) -> Events:
        return dict(_last=follow(last=self.n, bad=jnp.where(self.last[0] > 0.5, jnp.nan, 0.0)))


class Rack(Component):
    parts: Array[Counters]


class Start(Component):
    """The initial equation reads `initial` and, by `last_high`, the value that it determines itself."""

    x: Var[Scalar, ""] = 0.0
    initial: Discrete[Scalar, ""] = 1.0
    starts: Discrete[Scalar, ""] = 0.0
    high: Var[Scalar, ""] = 0.0
    last_high: Discrete[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        rate = jnp.where(self.initial != 0.0, 100.0, 1.0)
        return dict(rate=eq(d.x, rate), high=eq(self.high, number(truth(self.x > 2.0))))

    def initial_equations(self, d: Self) -> Equations:
        return dict(start=eq(self.x, jnp.where(self.initial != 0.0, 2.5 + 0.5 * self.last_high, 7.0)))

    def events(self) -> Events:
        changes = dict(initial=0.0, starts=self.starts + self.initial)
        return dict(start=started(**changes), _last=follow(last_high=self.high))


class Floor(Component):
    """A mass on a rough floor, pushed by a sine force."""

    mass: translational.Mass
    friction: translational.StribeckFriction | Friction
    push: translational.SignalForce
    force: blocks.Sine

    def connections(self) -> Connections:
        return (
            connect(self.mass.a, self.friction.flange),
            connect(self.mass.b, self.push.flange),
            connect(self.force.y, self.push.u),
        )
