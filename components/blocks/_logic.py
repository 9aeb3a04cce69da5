"""Logic of signals that are 0 or 1 (as in MSL `Modelica.Blocks.Logical`), and comparisons that make them.

A signal counts as 1 for timers, latches and counters if it exceeds 1/2.
"""

from collections.abc import Mapping
from typing import Any, ClassVar, Self

import jax.numpy as jnp

from acausal import (
    Component,
    Discrete,
    Equations,
    Events,
    Param,
    ParameterError,
    Requirements,
    Scalar,
    Time,
    at,
    eq,
    ifelse,
    nonnegative,
    positive,
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


class TwoPointController(OnOff):
    """y switches to 1 if u_m falls below u_s - bandwidth / 2, and to 0 if u_m exceeds u_s + bandwidth / 2.

    As MSL `Logical.OnOffController`; both changes are events. Within the band y keeps its value, initially `is_on`.
    """

    mode_names: ClassVar[Mapping[str, Mapping[float, str]]] = {"is_on": {0.0: "off", 1.0: "on"}}

    bandwidth: Param[Scalar, "", positive]  # hysteresis of u_m
    u_s: Input = Input()  # setpoint
    u_m: Input = Input()  # measured value

    def events(self) -> Events:
        missing, half, is_on = self.u_s.value - self.u_m.value, 0.5 * self.bandwidth, self.is_on > 0.5
        return dict(
            on=when(~is_on & (missing > half), is_on=1.0),
            off=when(is_on & (missing < -half), is_on=0.0),
        )


class StateMachine(Component):
    """States 0, 1, ... with one of them active, and transitions (sequential function chart, IEC 61131-3).

    `StateMachine(transitions=[(0, 1), (1, 2), (2, 0)])` has an input u[k] for each transition and an output y[i] for
    each state, 1 while it is active. A transition fires if its first state is active and its input exceeds 1/2; each is
    an event. If several can fire, the last in the list does. A transition out of a state that is entered while its
    input is 1 fires at the same instant. To wait in a state, feed its output to an `OnDelay`. A run begins in `state`,
    0 by default (MSL `StateGraph`).
    """

    transitions: tuple[tuple[int, int], ...]
    state: Discrete[Scalar, "1"]
    u: tuple[Input, ...]
    y: tuple[Output, ...]

    def __init__(self, *, transitions: list[tuple[int, int]], state: int = 0) -> None:
        self.transitions = tuple((int(a), int(b)) for a, b in transitions)
        numbers = {number for pair in self.transitions for number in pair}
        if numbers != set(range(len(numbers))) or not numbers:
            raise ParameterError(
                f"StateMachine.transitions must name each of the states 0, 1, ..., got {sorted(numbers)}. Number the "
                "states without gaps."
            )
        if state not in numbers:
            raise ParameterError(f"StateMachine.state must be one of the states of the transitions, got {state}.")
        self.state = float(state)
        self.u = tuple(Input() for _ in self.transitions)
        self.y = tuple(Output() for _ in numbers)

    def _is(self, number: int) -> Any:
        return jnp.abs(self.state - number) < 0.5

    def equations(self, d: Self) -> Equations:
        return {f"state_{i}": eq(y.value, jnp.where(self._is(i), 1.0, 0.0)) for i, y in enumerate(self.y)}

    def events(self) -> Events:
        pairs = zip(self.transitions, self.u, strict=True)
        return {
            f"transition_{k}": when(self._is(first) & (u.value > 0.5), state=float(second))
            for k, ((first, second), u) in enumerate(pairs)
        }
