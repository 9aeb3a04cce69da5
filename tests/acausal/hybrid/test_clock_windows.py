"""Clocks in runs that go on from one another, or that begin long after the clock: each tick counts once."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Discrete, Equations, Events, Param, Scalar, Var, at, eq, simulate


class Clock(Component):
    """Counts its ticks, beside a state that grows at the rate 1."""

    first: Param[Scalar, "s"]
    every: Param[Scalar, "s"]
    ticks: Discrete[Scalar, "1"] = 0.0
    x: Var[Scalar, "s"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, 1.0))

    def events(self) -> Events:
        return dict(tick=at(self.first, every=self.every, ticks=self.ticks + 1.0))


@jax.jit
@jax.vmap
def in_windows(first: Any, every: Any, times: Any) -> Any:
    """Ticks and x after a run that is resumed at all times but the first and the last."""

    def window(state: Any, ends: Any) -> Any:
        model = Clock(first=first, every=every, ticks=state[0], x=state[1])
        final = simulate(model, ends[1], t0=ends[0], save="end", resume=True, throw=False).final
        return jnp.stack([jnp.asarray(final.ticks), jnp.asarray(final.x)]), None

    return jax.lax.scan(window, jnp.zeros(2), jnp.stack([times[:-1], times[1:]], axis=1))[0]


WINDOWS = 60


def compared(first: Any, every: Any, times: Any) -> None:
    """The last time lies in the middle between two ticks."""
    found = in_windows(first, every, times)
    passed = np.round((times[:, -1] - first) / every - 0.5)
    np.testing.assert_allclose(found[:, 1], times[:, -1] - times[:, 0], rtol=1e-9)
    np.testing.assert_array_equal(found[:, 0], passed + 1.0)


def clocks() -> tuple[np.ndarray, np.ndarray]:
    """First ticks, also below zero, and intervals."""
    first, every = np.array([0.03, 0.0, 0.3, -1.0, -0.07, 2.0]), np.array([0.1, 0.1, 0.7, 0.1, 1.0 / 3.0, 1e-3])
    return first, every


@pytest.mark.thorough
def test_windows_that_end_between_ticks() -> None:
    first, every = clocks()
    draw = np.random.default_rng(1)
    turns = np.sort(draw.integers(0, 100, (len(first), WINDOWS)) + draw.uniform(0.1, 0.9, (len(first), WINDOWS)))
    times = first[:, None] + every[:, None] * np.column_stack([turns[:, 0] * 0.0 - 0.5, turns, turns[:, -1] // 1 + 1.5])
    compared(first, every, times)


def test_windows_that_end_at_ticks() -> None:
    """Exactly, or as many roundings away as two ways to compute the same time."""
    first, every = clocks()
    turns = np.concatenate([[-0.5], np.arange(WINDOWS), [WINDOWS - 0.5]])
    compared(first, every, first[:, None] + every[:, None] * turns)
    summed = first[:, None] + np.cumsum(np.column_stack([0.0 * every, *[every] * (WINDOWS - 1)]), axis=1)
    ends = first + every * (WINDOWS - 0.5)
    compared(first, every, np.column_stack([first - 0.5 * every, summed, ends]))


@jax.jit
@jax.vmap
def begun(first: Any, every: Any, t0: Any) -> Any:
    """Ticks of a run over half an interval."""
    final = simulate(Clock(first=first, every=every), t0 + 0.5 * every, t0=t0, save="end", throw=False).final
    return final.ticks


@pytest.mark.thorough
def test_a_clock_that_is_due_at_the_start_ticks_there_once() -> None:
    """However long before the start it began."""
    turns = np.array([0, 1, 3, 10, 1000, 10**7, 17, 123456])
    every = np.array([0.1, 0.1, 0.1, 0.1, 1.0 / 3.0, 0.1, 1e-3, 0.7])
    for t0 in (0.0, 0.7, -2.0):
        np.testing.assert_array_equal(begun(t0 - every * turns, every, np.full(len(every), t0)), 1.0)
