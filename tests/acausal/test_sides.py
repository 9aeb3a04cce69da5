"""On which side of zero a margin is when its event happens, whichever expression and whichever program computes it."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Discrete, Equations, Events, Param, Result, Scalar, Time, Var, at, eq, simulate, when


class Valve(Component):
    """A valve that is open while a signal o + a sin(2 pi f t + p) is positive.

    Other numbers tell that it closes. They are zero where the signal is zero, except for rounding.
    """

    frequency: Param[Scalar, "Hz"]
    phase: Param[Scalar, "rad"]
    amplitude: Param[Scalar, "1"]
    offset: Param[Scalar, "1"]
    time: Time[Scalar, "s"] = 0.0
    signal: Var[Scalar, "1"] = 0.0
    passed: Var[Scalar, "s"] = 0.0
    is_open: Discrete[Scalar, "1"] = 1.0
    count: Discrete[Scalar, "1"] = 0.0

    def _sine(self) -> Scalar:
        return jnp.sin(2.0 * np.pi * self.frequency * self.time + self.phase)

    def equations(self, d: Self) -> Equations:
        return dict(
            signal=eq(self.signal, self.offset + self.amplitude * self._sine()),
            passing=eq(d.passed, self.signal * self.is_open),
        )

    def events(self) -> Events:
        closes = (self.is_open > 0.5) & (self._sine() <= -self.offset / self.amplitude)
        return dict(
            opens=when((self.is_open < 0.5) & (self.signal > 0.0), is_open=1.0, count=self.count + 1.0),
            closes=when(closes, is_open=0.0, count=self.count + 1.0),
        )


def changes(frequency: float, phase: float, amplitude: float, offset: float) -> int:
    """The number of changes of the valve, open at first, within a second, including a change at once."""
    angle = np.arcsin(-offset / amplitude)
    turns = 2.0 * np.pi * np.arange(-2, 3)
    zeros = (np.concatenate([angle + turns, np.pi - angle + turns]) - phase) / (2.0 * np.pi * frequency)
    return int(np.sum((zeros > 0.0) & (zeros < 1.0)) + (offset + amplitude * np.sin(phase) <= 0.0))


@pytest.mark.thorough
def test_what_opens_and_closes_by_the_same_signal_does_so_in_turn() -> None:
    cases = np.random.default_rng(0).uniform((0.02, 0.0, 0.5, -0.3), (0.3, 6.0, 2.0, 0.3), (3000, 4))

    def counted(case: jax.Array) -> tuple[Any, Any]:
        valve = Valve(frequency=case[0], phase=case[1], amplitude=case[2], offset=case[3])
        run = simulate(valve, 1.0, save="end", rtol=1e-8, max_events=100, throw=False)
        return run.final.count, run.result == Result.reached_end

    counts, are_ok = jax.jit(jax.vmap(counted))(cases)
    assert np.all(are_ok)
    np.testing.assert_array_equal(counts, [changes(*case) for case in cases])


class Clamped(Component):
    """A body that is set to the limit that it has passed, and stays there."""

    limit: Param[Scalar, "m"] = 0.3
    x: Var[Scalar, "m"] = 0.0
    speed: Var[Scalar, "m/s"] = 1.0
    hits: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, self.speed), speed=eq(d.speed, 0.0, check_units=False))

    def events(self) -> Events:
        return dict(hits=when(self.x > self.limit, x=self.limit, speed=0.0, hits=self.hits + 1.0))


@pytest.mark.thorough
def test_what_is_set_to_its_limit_has_not_passed_it() -> None:
    end = simulate(Clamped(), 1.0, save="end").final
    assert (float(end.x), float(end.hits)) == (0.3, 1.0)


class Ticked(Component):
    """x rises slowly, is set below zero at one time, and counted at another; and how often has it become positive?"""

    set_at: Param[Scalar, "s"]
    counted_at: Param[Scalar, "s"]
    limit: Param[Scalar, "s"]
    time: Time[Scalar, "s"] = 0.0
    x: Var[Scalar, "s"] = 1.0
    ticks: Discrete[Scalar, "1"] = 0.0
    rises: Discrete[Scalar, "1"] = 0.0
    passed: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, 0.01))

    def events(self) -> Events:
        return dict(
            falls=at(self.set_at, x=-1.0),
            tick=at(self.counted_at, ticks=self.ticks + 1.0),
            rises=when(self.x > 0.0, rises=self.rises + 1.0),
            passes=when(self.time >= self.limit, passed=self.passed + 1.0),
        )


@pytest.mark.thorough
def test_what_is_scheduled_finds_the_sides_at_its_time() -> None:
    """They are those of the end of the step that leads to it, not those of its start."""
    rng = np.random.default_rng(0)
    set_at, limit = rng.uniform(0.1, 3.0, 1000), rng.uniform(-2.0, 7.0, 1000)
    counted_at = set_at + 10.0 ** rng.uniform(-6.0, 0.5, 1000)

    @jax.jit
    @jax.vmap
    def run(set_at: Any, counted_at: Any, limit: Any) -> Any:
        model = Ticked(set_at=set_at, counted_at=counted_at, limit=limit)
        f = simulate(model, 7.3, save="end", throw=False).final
        return jnp.stack([f.rises, f.ticks, f.passed, f.x])

    found = run(set_at, counted_at, limit)
    np.testing.assert_array_equal(found[:, :3], 1.0)
    np.testing.assert_allclose(found[:, 3], -1.0 + 0.01 * (7.3 - set_at), rtol=1e-9)
