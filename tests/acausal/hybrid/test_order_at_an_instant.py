"""Jumps, conditions and clocks at one instant: clocks read what holds after all others, and each other's old values."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import (
    Component,
    Discrete,
    Equations,
    Events,
    Param,
    Scalar,
    Time,
    Var,
    at,
    eq,
    ifelse,
    refuse,
    simulate,
    when,
)

READ = ("state", "steps", "counted", "algebraic")


class Cascade(Component):
    """At `jump`, x and a step are set, which makes a condition true that counts; a clock samples all of it."""

    jump: Param[Scalar, "s"]
    start: Param[Scalar, "s"]
    period: Param[Scalar, "s"]
    x: Var[Scalar, "1"] = 0.0
    twice: Var[Scalar, "1"] = 0.0
    step: Discrete[Scalar, "1"] = 0.0
    count: Discrete[Scalar, "1"] = 0.0
    state: Discrete[Scalar, "1"] = -1.0
    steps: Discrete[Scalar, "1"] = -1.0
    counted: Discrete[Scalar, "1"] = -1.0
    algebraic: Discrete[Scalar, "1"] = -1.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x), twice=eq(self.twice, 2.0 * self.x + self.step))

    def events(self) -> Events:
        return dict(
            sample=at(
                self.start,
                every=self.period,
                state=self.x,
                steps=self.step,
                counted=self.count,
                algebraic=self.twice,
            ),
            more=when(self.twice > 7.0, count=self.count + 1.0),
            jump=at(self.jump, x=3.0, step=2.0),
        )


@jax.jit
@jax.vmap
def sampled(jump: Any, start: Any, period: Any, t1: Any) -> Any:
    model = Cascade(jump=jump, start=start, period=period)
    final = simulate(model, t1, save="end", throw=False).final
    return jnp.stack([getattr(final, name) for name in READ])


@pytest.mark.thorough
def test_a_clock_reads_what_held_before_a_later_jump_and_after_an_earlier_one() -> None:
    jump, start = np.array([0.75, 0.25, 0.0, 1.0]), np.array([0.5, 0.5, 0.5, 0.0])
    found = sampled(jump, start, np.full(4, 10.0), np.full(4, 1.5))
    before, after = [0.0, 0.0, 0.0, 0.0], [3.0, 2.0, 1.0, 8.0]
    np.testing.assert_allclose(found, [before, after, after, before], atol=1e-9)


def test_a_clock_reads_what_holds_after_all_jumps_of_its_instant() -> None:
    """At the start, and at instants that are equal but for rounding."""
    jump = np.array([0.0, 0.3, 0.7, 0.1 + 0.2])
    start, period = np.array([0.0, 0.0, 0.7, 0.0]), np.array([10.0, 0.1, 10.0, 0.3])
    found = sampled(jump, start, period, jump + 0.05)
    np.testing.assert_allclose(found, np.tile([3.0, 2.0, 1.0, 8.0], (4, 1)), atol=1e-9)


class Exchange(Component):
    """Two controllers that set what they hold from each other's, one slower than the other."""

    h: Param[Scalar, "s"]
    a: Discrete[Scalar, "1"] = 1.0
    b: Discrete[Scalar, "1"] = 0.0
    x: Var[Scalar, "s"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, self.a, check_units=False))

    def events(self) -> Events:
        return dict(
            first=at(0.0, every=self.h, a=self.a + self.b),
            second=at(0.0, every=2.0 * self.h, b=self.a),
        )


@pytest.mark.thorough
def test_clocks_read_each_others_old_values() -> None:
    a, b, x, h = 1.0, 0.0, 0.0, 0.1
    for i in range(11):
        a, b = a + b, a if i % 2 == 0 else b
        x += a * (h if i < 10 else 0.5 * h)
    final = simulate(Exchange(h=h), 10.5 * h, save="end", rtol=1e-9).final
    np.testing.assert_allclose(np.array([final.a, final.b, final.x]), [a, b, x], rtol=1e-9)


class TimedTwice(Component):
    """Two events at one time, one of them by a condition on time, which read what the other one sets."""

    jump: Param[Scalar, "s"] = 0.5
    t: Time[Scalar, "s"] = 0.0
    a: Discrete[Scalar, "1"] = 1.0
    b: Discrete[Scalar, "1"] = 2.0

    def events(self) -> Events:
        return dict(first=at(self.jump, a=self.b + 10.0), second=when(self.t > self.jump, b=self.a + 100.0))


def test_a_condition_on_time_reads_the_values_before_a_simultaneous_event() -> None:
    final = simulate(TimedTwice(), 1.0, save="end").final
    assert (float(final.a), float(final.b)) == (12.0, 101.0)


class Chain(Component):
    """Each relation depends on the one before. Two events read the last value, and one refuses its other value."""

    z: Var[Scalar, "1"] = 0.0
    s: Var[Scalar, "1"] = 5.0
    count: Discrete[Scalar, "1"] = 0.0
    start: Discrete[Scalar, "1"] = 0.0
    held: Discrete[Scalar, "1"] = -1.0

    def equations(self, d: Self) -> Equations:
        first = ifelse(self.count + self.start > 0.5, 1.0, 0.0)
        second = ifelse(first > 0.5, 2.0, 0.0)
        return dict(z=eq(self.z, ifelse(second > 1.0, 3.0, 0.0)), s=eq(d.s))

    def events(self) -> Events:
        return dict(
            step=at(0.5, count=1.0),
            read=when(self.count > 0.5, s=self.z, held=self.z),
            never=refuse((self.count + self.start > 0.5) & (self.z < 2.0), "z is below 2"),
        )


def test_what_reads_values_of_relations_waits_for_all_of_them() -> None:
    """So at the start of a run, where all relations begin with a guess, as at an event."""
    for start in (0.0, 1.0):
        final = simulate(Chain(start=start), 1.0, save="end").final
        assert (final.s, final.held, final.z) == (3.0, 3.0, 3.0)
