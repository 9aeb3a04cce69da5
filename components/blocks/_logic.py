"""Logic of signals that are 0 or 1 (as in MSL `Modelica.Blocks.Logical`), and comparisons that make them.

A signal counts as 1 for timers, latches and counters if it exceeds 1/2.
"""

from typing import Any, Self

import jax.numpy as jnp

from acausal import (
    Component,
    Discrete,
    Equations,
    Events,
    Param,
    Requirements,
    Scalar,
    Time,
    at,
    eq,
    ifelse,
    nonnegative,
    require,
    when,
)

from ._interfaces import SI2SO, SISO, Input, Output


class And(SI2SO):
    """y = u1 u2: 1 if both signals are 1."""

    def equations(self, d: Self) -> Equations:
        return dict(law=eq(self.y.value, self.u1.value * self.u2.value))


class Or(SI2SO):
    """y = u1 + u2 - u1 u2: 1 if one of two signals is 1, or both are."""

    def equations(self, d: Self) -> Equations:
        return dict(law=eq(self.y.value, self.u1.value + self.u2.value - self.u1.value * self.u2.value))


class Xor(SI2SO):
    """y = u1 + u2 - 2 u1 u2: 1 if exactly one of two signals is 1."""

    def equations(self, d: Self) -> Equations:
        return dict(law=eq(self.y.value, self.u1.value + self.u2.value - 2.0 * self.u1.value * self.u2.value))


class Not(SISO):
    """y = 1 - u: 1 if the signal is 0."""

    def equations(self, d: Self) -> Equations:
        return dict(law=eq(self.y.value, 1.0 - self.u.value))


class Comparator(SI2SO):
    """y = 1 while u1 > u2, otherwise 0 (MSL `Greater`); both changes are events.

    If its output drives the inputs back across each other, use `Hysteresis` or `TwoPointController`.
    """

    def equations(self, d: Self) -> Equations:
        return dict(comparison=eq(self.y.value, ifelse(self.u1.value > self.u2.value, 1.0, 0.0)))


class OnOff(Component, partial=True):
    """A block whose output is 0 or 1 and changes by events."""

    is_on: Discrete[Scalar, "1"] = 0.0  # y
    y: Output = Output()

    def equations(self, d: Any) -> Equations:
        return dict(output=eq(self.y.value, self.is_on))


class Hysteresis(OnOff):
    """y switches to 1 if u exceeds `high`, and to 0 if it falls below `low` (MSL `Hysteresis`); both are events.

    Between them y keeps its value, initially `is_on`.
    """

    low: Param[Scalar, ""]  # u below which y switches to 0
    high: Param[Scalar, ""]  # u above which y switches to 1
    u: Input = Input()

    def requirements(self) -> Requirements:
        return (require(self.low < self.high, "low must be smaller than high"),)

    def events(self) -> Events:
        u, is_on = self.u.value, self.is_on > 0.5
        return dict(on=when(~is_on & (u > self.high), is_on=1.0), off=when(is_on & (u < self.low), is_on=0.0))


class Latch(OnOff):
    """y is 1 while `set` is, and keeps its value until `reset` is 1 (MSL `RSFlipFlop`). While `reset` is 1, y is 0."""

    set: Input = Input()
    reset: Input = Input()

    def events(self) -> Events:
        is_set, is_reset = self.set.value > 0.5, self.reset.value > 0.5
        return dict(rise=when(is_set & ~is_reset, is_on=1.0), fall=when(is_reset, is_on=0.0))


class Monostable(OnOff):
    """y = 1 for the time T after each rising edge of u, from 0 to 1; a further edge during this time prolongs it.

    An edge detector is a `Monostable` with T shorter than all other times of the model.
    """

    T: Param[Scalar, "s", nonnegative]  # duration of the pulse
    ends: Discrete[Scalar, "s"] = -jnp.inf  # end of the last pulse
    t: Time[Scalar, "s"] = 0.0
    u: Input = Input()

    def events(self) -> Events:
        return dict(
            edge=when(self.u.value > 0.5, is_on=1.0, ends=self.t + self.T),
            end=at(self.ends, is_on=0.0),
        )


class OnDelay(OnOff):
    """y becomes 1 when u has been 1 for the time T, and 0 when u does (MSL `MathBoolean.OnDelay`)."""

    T: Param[Scalar, "s", nonnegative]  # delay
    due: Discrete[Scalar, "s"] = jnp.inf  # time at which y becomes 1
    t: Time[Scalar, "s"] = 0.0
    u: Input = Input()

    def events(self) -> Events:
        is_high = self.u.value > 0.5
        return dict(
            rise=when(is_high, due=self.t + self.T),
            end=at(self.due, is_on=1.0),
            fall=when(~is_high, is_on=0.0, due=jnp.inf),
        )


class Timer(SISO):
    """y = time since u became 1, in s; 0 while u is 0 (MSL `Timer`)."""

    running: Discrete[Scalar, "1"] = 0.0  # 1 while u is 1
    began: Discrete[Scalar, "s"] = 0.0  # time of the last rising edge
    t: Time[Scalar, "s"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(elapsed=eq(self.y.value, self.running * (self.t - self.began)))

    def events(self) -> Events:
        is_high = self.u.value > 0.5
        return dict(rise=when(is_high, running=1.0, began=self.t), fall=when(~is_high, running=0.0))


class Counter(Component):
    """y = number of rising edges of u since the last rising edge of `reset`."""

    count: Discrete[Scalar, "1"] = 0.0  # y
    u: Input = Input()
    reset: Input = Input()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(output=eq(self.y.value, self.count))

    def events(self) -> Events:
        edge, reset = self.u.value > 0.5, self.reset.value > 0.5
        return dict(edge=when(edge, count=self.count + 1.0), reset=when(reset, count=0.0))
