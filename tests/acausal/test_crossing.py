"""Conditions that are true for a short time within a step."""

import functools as ft
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array, Float

from acausal import Component, Discrete, Equations, Events, Param, Scalar, Time, Var, eq, simulate, when
from acausal._integrate.events.crossing import Conditions, Returns, first_crossing
from acausal._integrate.step.interval import PathSample, sample
from acausal._reduce.event_indicators import circuit

Pair = Float[Array, "2"]
N = 48
END = 10.0


class Peaks(Component):
    """Conditions on x, which rises at the rate 1, and y, which falls: one solution, and steps as long as the run."""

    a: Param[Pair, "1"]
    b: Param[Pair, "1"]
    r: Param[Pair, "1"]
    x: Var[Scalar, "1"] = 0.0
    y: Var[Scalar, "1"] = 0.0
    mode: Discrete[Scalar, "1"] = 1.0
    bump: Discrete[Scalar, "1"] = 0.0
    guarded: Discrete[Scalar, "1"] = 0.0
    idle: Discrete[Scalar, "1"] = 0.0
    both: Discrete[Scalar, "1"] = 0.0
    either: Discrete[Scalar, "1"] = 0.0
    unless: Discrete[Scalar, "1"] = 0.0
    window: Discrete[Scalar, "1"] = 0.0
    chosen: Discrete[Scalar, "1"] = 0.0
    when_both: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, 1.0, check_units=False), y=eq(d.y, -1.0, check_units=False))

    def events(self) -> Events:
        x, y = self.x, -self.y
        first = (self.r[0] ** 2 - (x - self.a[0]) ** 2) > 0.0
        second = (self.r[1] ** 2 - (y - self.a[1]) ** 2) > 0.0
        after, before = x > self.b[0], y < self.b[1]
        return dict(
            bump=when(first, bump=self.bump + 1.0),
            guarded=when((self.mode > 0.5) & first, guarded=self.guarded + 1.0),
            idle=when((self.mode > 1.5) & first, idle=self.idle + 1.0),
            either=when(first | second, either=self.either + 1.0),
            both=when(after & before, both=self.both + 1.0, when_both=x),
            unless=when(~(before | ~after), unless=self.unless + 1.0),
            window=when((x > self.a[0]) & (x < self.a[0] + self.r[0]), window=self.window + 1.0),
            chosen=when(jnp.where(after, second, first), chosen=self.chosen + 1.0),
        )


NAMES = ("bump", "guarded", "idle", "either", "both", "unless", "window", "chosen")


@jax.jit
@jax.vmap
def found(a: Any, b: Any, r: Any) -> Any:
    final = simulate(Peaks(a=a, b=b, r=r), END, dt0=END, save="end", throw=False, max_events=64).final
    return jnp.stack([getattr(final, name) for name in NAMES]), final.when_both


def onsets(*intervals: tuple[float, float]) -> int:
    """The number of beginnings of a union of intervals."""
    return sum(
        not any(i != j and a <= low < b for j, (a, b) in enumerate(intervals)) for i, (low, _) in enumerate(intervals)
    )


def expected(a: np.ndarray, b: np.ndarray, r: np.ndarray) -> list[int]:
    first, second = ((a[i] - r[i], a[i] + r[i]) for i in (0, 1))
    early = [(first[0], min(first[1], b[0]))] if first[0] < b[0] else []
    late = [(max(second[0], b[0]), second[1])] if second[1] > b[0] else []
    return [1, 1, 0, onsets(first, second), int(b[0] < b[1]), 1, 1, onsets(*early, *late)]


def test_short_peaks_of_each_relation() -> None:
    """One margin turns within a step, or several relations joined by `&` and `|` hold together for a short time."""
    rng = np.random.default_rng(3)
    a, b = rng.uniform(1.0, 9.0, (N, 2)), rng.uniform(1.0, 9.0, (N, 2))
    b[::3, 1] = b[::3, 0] + rng.choice([-1.0, 1.0], len(b[::3])) * 10.0 ** rng.uniform(-6.0, -1.0, len(b[::3]))
    r = 10.0 ** rng.uniform(-5.0, -0.5, (N, 2))
    counts, times = found(a, b, r)
    wanted = np.array([expected(*row) for row in zip(a, b, r, strict=True)])
    for i, name in enumerate(NAMES):
        np.testing.assert_array_equal(counts[:, i], wanted[:, i], err_msg=name)
    happened = wanted[:, NAMES.index("both")] == 1
    np.testing.assert_allclose(times[happened], b[happened, 0], rtol=1e-12)


class Wave(Component):
    """x oscillates; its peaks above a level are short."""

    level: Param[Scalar, "1"]
    w: Param[Scalar, "1/s"]
    t: Time[Scalar, "s"] = 0.0
    x: Var[Scalar, "1"] = 0.0
    v: Var[Scalar, "1"] = 1.0
    peaks: Discrete[Scalar, "1"] = 0.0
    first: Discrete[Scalar, "s"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, self.w * self.v), v=eq(d.v, -self.w * self.x))

    def events(self) -> Events:
        return dict(
            peak=when(self.x > self.level, peaks=self.peaks + 1.0, first=jnp.where(self.peaks > 0, self.first, self.t))
        )


@pytest.mark.thorough
def test_short_peaks_of_a_solution() -> None:
    """At a tolerance at which steps are as long as a quarter of a turn, down to peaks of a share 1e-3 of it."""
    rng = np.random.default_rng(4)
    w, height = rng.uniform(0.5, 2.0, 24), 10.0 ** rng.uniform(-6.0, -1.0, 24)

    @jax.jit
    @jax.vmap
    def run(level: Any, w: Any) -> Any:
        final = simulate(Wave(level=level, w=w), 20.0, rtol=1e-7, save="end", throw=False).final
        return final.peaks, final.first

    peaks, first = run(1.0 - height, w)
    arc = np.arcsin(1.0 - height)
    np.testing.assert_array_equal(peaks, np.floor((20.0 * w - arc) / (2.0 * np.pi)) + 1.0)
    np.testing.assert_allclose(first, arc / w, rtol=1e-3)


@pytest.mark.thorough
def test_a_crossing_function_that_is_infinite_is_looked_at_once() -> None:
    """As that of a stop on one side only, whose other side is infinitely far away."""
    times: list[float] = []

    def functions(t: Any) -> Any:
        jax.debug.callback(lambda t: times.append(float(t)), t)
        return jnp.stack([t - jnp.inf, jnp.inf - t, t - 20.0])

    none = np.zeros(3, bool)
    logic = circuit([("holds", i) for i in range(3)], 3)
    conditions = Conditions(ft.partial(sample, functions), logic, none, jnp.zeros(3), jnp.ones(3, bool), none, none)
    truths, yes = jnp.array([False, True, False]), jnp.asarray(True)
    unknown = PathSample(0.0, jnp.zeros(3), jnp.zeros(3), jnp.zeros(0), jnp.zeros(0), 0.0)
    looked = first_crossing(conditions, unknown, ~yes, truths, Returns.none(3), jnp.asarray(0.5), 1e-12, yes)
    jax.effects_barrier()
    assert not looked.is_any
    assert sorted(times) == [0.0, 0.5]


class Rise(Component):
    """x rises at the rate 1."""

    x: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, 1.0, check_units=False))


@pytest.mark.parametrize("width", [1.0, 1e-3, 1e-6])
def test_a_stop_where_several_relations_hold_at_once(width: float) -> None:
    """As the smallest of their margins, however short that lasts."""
    run = simulate(Rise(), END, until=lambda s: jnp.minimum(s.x - 5.0, 5.0 + width - s.x), save="end")
    np.testing.assert_allclose(run.t1, 5.0, rtol=1e-12)
