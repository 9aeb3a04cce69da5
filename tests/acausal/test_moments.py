"""Events at one instant, or nearly so: each happens once, and each has a moment of its own, to the second order."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array, Float

from acausal import Component, Discrete, Equations, Events, Param, Scalar, Time, Var, at, eq, simulate, when

Four = Float[Array, "4"]


class Clocks(Component):
    """Four ways to count that a time has come, a clock, a rate that a clock sets again, and a rate that jumps."""

    times: Param[Four, "s"]
    first: Param[Scalar, "s"]
    t: Time[Scalar, "s"] = 0.0
    x: Var[Scalar, "s"] = 0.0
    y: Var[Scalar, "s"] = 0.0
    once: Discrete[Scalar, "1"] = 0.0
    again: Discrete[Scalar, "1"] = 0.0
    after: Discrete[Scalar, "1"] = 0.0
    reached: Discrete[Scalar, "1"] = 0.0
    ticks: Discrete[Scalar, "1"] = 0.0
    rate: Discrete[Scalar, "1"] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, self.rate), y=eq(d.y, jnp.where(self.t >= self.times[0], 1.0, 0.0)))

    def events(self) -> Events:
        return dict(
            once=at(self.times[0], once=self.once + 1.0),
            again=at(self.times[1], again=self.again + 1.0),
            after=when(self.t > self.times[2], after=self.after + 1.0),
            reached=when(self.t >= self.times[3], reached=self.reached + 1.0),
            clock=at(self.first, every=0.1, ticks=self.ticks + 1.0, rate=1.0 * self.rate),
        )


@jax.jit
@jax.vmap
def counted(times: Any, first: Any, t0: Any) -> Any:
    sol = simulate(Clocks(times=times, first=first), 2.0, t0=t0, save="end", rtol=1e-8, throw=False)
    f = sol.final
    return jnp.stack([f.once, f.again, f.after, f.reached]), f.ticks, jnp.stack([f.x, f.y]), sol.stats["num_steps"]


@pytest.mark.thorough
def test_what_comes_at_one_instant_but_for_rounding_comes_once() -> None:
    """A few roundings apart or equal, at zero and elsewhere, in runs that start before zero or at it."""
    rng = np.random.default_rng(1)
    n = 60
    t0 = rng.choice([-5.0, -0.3, 0.0, -40.0], n)
    instant = np.where(rng.random(n) < 0.4, 0.0, rng.choice([0.1 + 0.2, 0.7, 1.0], n))
    apart = rng.integers(-6, 7, (n, 4)) * np.spacing(np.maximum(np.abs(t0), instant))[:, None]
    times = instant[:, None] + np.where((instant == t0)[:, None], 0.0, apart)
    first = t0 + rng.choice([0.0, 0.3, -3.0], n)
    counts, ticks, values, steps = counted(times, first, t0)
    np.testing.assert_array_equal(counts, np.ones((n, 4)))
    # A clock that has begun before the start ticks once there; one that is due at the end may tick or not.
    exact = 10.0 * (2.0 - np.maximum(first, t0)) + 1.0
    assert np.all((np.abs(ticks - exact) < 1e-6) | (np.abs(ticks - exact + 1.0) < 1e-6))
    np.testing.assert_allclose(values, np.stack([2.0 - t0, 2.0 - instant], axis=1), rtol=1e-12)
    assert np.all(steps < 11.0 * (2.0 - t0) + 20.0)


@pytest.mark.thorough
@pytest.mark.parametrize("is_tick", [False, True])
def test_what_happens_a_few_roundings_before_the_end_takes_no_steps_to_come_to(is_tick: bool) -> None:
    """An equation that jumps there, or the last tick of a clock: as many steps as to what happens far from the end.
    What rounding does not tell from the end happens in the run that continues this one.
    """
    apart = np.arange(1, 401)
    t0 = np.where(apart % 2, -40.0, -0.3)
    near = 2.0 - apart * np.spacing(1.0)
    is_before = apart * np.spacing(1.0) > 4.0 * np.finfo(float).eps * np.maximum(2.0, -t0)
    late, times = np.full(len(apart), 50.0), np.full((len(apart), 4), 0.7)
    *_, far = counted(times, near - 0.05 if is_tick else late, t0)
    times[:, 0] = 0.7 if is_tick else near
    counts, ticks, _, steps = counted(times, near if is_tick else late, t0)
    np.testing.assert_array_equal(counts[:, 1:], 1.0)
    np.testing.assert_array_equal(counts[:, 0], 1.0 if is_tick else is_before)
    np.testing.assert_array_equal(ticks, is_tick & is_before)
    assert np.all(steps <= far + 2)


class Growth(Component):
    """x grows whatever happens at T."""

    T: Param[Scalar, "s"]
    x: Var[Scalar, "1"] = 1.0
    n: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, 3.0 * self.x, check_units=False))

    def events(self) -> Events:
        return dict(tick=at(self.T, n=self.n + 1.0))


@pytest.mark.thorough
@pytest.mark.parametrize("mode", [jax.jacfwd, jax.jacrev])
def test_an_instant_next_to_the_end_takes_none_of_the_derivative_by_the_end(mode: Any) -> None:
    apart = jnp.asarray([0.0, 1.0, 2.0, 5.0, 100.0, 1e4]) * np.spacing(1.0)

    def grown(T: Any, t1: Any) -> Any:
        return simulate(Growth(T=T), t1, save="end", rtol=1e-9).final.x

    by_instant, by_end = jax.jit(jax.vmap(mode(grown, argnums=(0, 1)), (0, None)))(1.0 - apart, 1.0)
    np.testing.assert_allclose(by_instant, 0.0, atol=1e-6)
    np.testing.assert_allclose(by_end, 3.0 * np.exp(3.0), rtol=1e-7)


class Turns(Component):
    """At T1 and T2 the rate k of x jumps, z is set, and w where k leaps; when x falls below c, z grows by x."""

    T1: Param[Scalar, "s"]
    T2: Param[Scalar, "s"]
    c: Param[Scalar, "1"]
    t: Time[Scalar, "s"] = 0.0
    k: Var[Scalar, "1"] = 0.0
    x: Var[Scalar, "1"] = 1.0
    z: Var[Scalar, "1"] = 1.0
    w: Var[Scalar, "1"] = 1.0
    r: Discrete[Scalar, "1"] = 1.0

    def equations(self, d: Self) -> Equations:
        k = jnp.where(self.t < self.T1, 1.0, jnp.where(self.t < self.T2, -2.0, 0.5))
        return dict(
            k=eq(self.k, k),
            x=eq(d.x, self.k * self.x, check_units=False),
            z=eq(d.z, self.r * self.z, check_units=False),
            w=eq(d.w, 0.5 * self.w, check_units=False),
        )

    def events(self) -> Events:
        return dict(
            first=at(self.T1, z=self.z * 2.0 * self.c, r=-self.r),
            second=at(self.T2, z=self.z**2, r=-2.0 * self.r),
            low=when(self.x < self.c, z=self.z + self.x),
            leap=when(self.k < -1.0, w=self.z * self.x),
        )


def run(p: Any) -> Any:
    T1, T2, c, x, z = p
    final = simulate(Turns(T1=T1, T2=T2, c=c, x=x, z=z), 2.0, t0=-1.0, save="end", rtol=1e-10, throw=False).final
    return jnp.stack([final.x, final.z, final.w])


def exactly(p: Any) -> Any:
    """For c below x at the start."""
    T1, T2, c, x0, z0 = p
    top, z1 = x0 * jnp.exp(T1 + 1.0), 2.0 * c * z0 * jnp.exp(T1 + 1.0)
    bottom = top * jnp.exp(-2.0 * (T2 - T1))
    low = T1 + 0.5 * jnp.log(top / c)
    z2 = z1 * jnp.exp(T1 - T2) + jnp.where(bottom < c, c * jnp.exp(low - T2), 0.0)
    w = z1 * top * jnp.exp(0.5 * (2.0 - T1))
    return jnp.stack([bottom * jnp.exp(0.5 * (2.0 - T2)), z2**2 * jnp.exp(2.0 * (2.0 - T2)), w])


# Far apart, and so close together that the step between them is hardly longer than its rounding
APART = [0.6, 1e-3, 1e-6, 1e-9, 1e-12, 2e-14]
POINTS = [[T1, T1 + apart, c, 1.0, 1.1] for apart in APART for T1, c in [(0.3, 0.5), (0.0, 0.9)]]
BETWEEN = [[0.3, 1.3, 0.8, 1.0, 1.1], [0.0, 1.5, 0.5, 1.0, 0.9]]  # with an event of the state between T1 and T2


@pytest.fixture(scope="module")
def points() -> Any:
    return jnp.array(POINTS + BETWEEN)


def compare(found: Any, expected: Any, rtol: float) -> None:
    np.testing.assert_allclose(found, expected, atol=rtol * float(jnp.max(jnp.abs(expected))))


@pytest.mark.thorough
def test_first_and_second_derivatives(points: Any) -> None:
    """By the times of events, equations that jump, and conditions that leap."""

    def derivatives(function: Any) -> Any:
        def first(p: Any) -> Any:
            slopes = jax.jacfwd(function)(p)
            return slopes, slopes

        return jax.jit(jax.vmap(jax.jacfwd(first, has_aux=True)))(points)

    for found, expected in zip(derivatives(run), derivatives(exactly), strict=True):
        compare(found, expected, 1e-8)


@pytest.mark.thorough
def test_reverse_mode(points: Any) -> None:
    found = jax.jit(jax.vmap(jax.jacrev(run)))(points)
    compare(found, jax.vmap(jax.jacfwd(exactly))(points), 1e-9)


@pytest.mark.thorough
def test_the_time_of_a_stop_condition_that_leaps() -> None:
    def stopped(T1: Any, T2: Any) -> Any:
        return simulate(Turns(T1=T1, T2=T2, c=0.1), 2.0, until=lambda s: s.k + s.w, direction="down", save="end").t1

    slopes = jax.jit(jax.jacfwd(stopped, argnums=(0, 1)))(0.3, 0.9)
    np.testing.assert_allclose(jnp.stack(slopes), [1.0, 0.0], atol=1e-9)


class Closing(Component):
    """A valve that closes more and more slowly, and is shut at an opening of zero, on a vessel that runs empty besides.

    It never gets there, but for errors of steps, which make the opening change its sign again and again.
    """

    delay: Param[Scalar, "s"] = 1e-3  # T
    rate: Param[Scalar, "1/s"] = 1.0  # k
    opening: Var[Scalar, "1"] = 1.0  # exp(-t / T)
    content: Var[Scalar, "1"] = 1.0  # exp(-k t)
    passed: Var[Scalar, "s"] = 0.0  # T
    is_shut: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        opening = jnp.where(self.is_shut > 0.5, 0.0, self.opening)
        return dict(
            closing=eq(self.delay * d.opening, -self.opening),
            emptying=eq(d.content, -self.rate * self.content),
            passing=eq(d.passed, opening),
        )

    def events(self) -> Events:
        return dict(
            shuts=when((self.is_shut < 0.5) & (self.opening < 0.0), is_shut=1.0),
            opens=when((self.is_shut > 0.5) & (self.opening > 0.0), is_shut=0.0),
        )


@pytest.mark.thorough
@pytest.mark.parametrize("mode", [jax.jacfwd, jax.jacrev])
def test_what_decays_to_zero_has_no_moment_there(mode: Any) -> None:
    def found(numbers: Float[Array, "2"]) -> Array:
        delay, rate = numbers
        end = simulate(Closing(delay=delay, rate=rate), 1.0, save="end", rtol=1e-8).final
        return jnp.stack([end.content, end.passed])

    np.testing.assert_allclose(mode(found)(jnp.array([1e-3, 1.0])), [[0.0, -np.exp(-1.0)], [1.0, 0.0]], atol=1e-5)


class Past(Component):
    """Changes of x that do not commute, at times before the start, one of them again and again."""

    times: Param[Four, "s"]
    x: Discrete[Scalar, "1"] = 1.0
    y: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(y=eq(d.y, self.x, check_units=False))

    def events(self) -> Events:
        return dict(
            double=at(self.times[0], x=2.0 * self.x),
            add=at(self.times[1], x=self.x + 1.0),
            square=at(self.times[2], x=self.x**2),
            clock=at(self.times[3], every=0.7, x=self.x - 3.0),
        )


@pytest.mark.thorough
def test_events_in_the_past_happen_once_in_their_order() -> None:
    """From the last time of each; at one instant, with values from before, and the last in the list counts."""
    rng = np.random.default_rng(6)
    times = rng.uniform(-4.0, 0.0, (40, 4))
    times[::4, 1], times[::5, 2] = times[::4, 0], 0.0
    changes = (lambda x: 2.0 * x, lambda x: x + 1.0, lambda x: x**2, lambda x: x - 3.0)

    def exactly(row: np.ndarray) -> float:
        last = [*row[:3], row[3] + 0.7 * np.floor(-row[3] / 0.7)]
        x = 1.0
        for instant in sorted(set(last)):
            x = [change(x) for change, time in zip(changes, last, strict=True) if time == instant][-1]
        return x

    found = jax.jit(jax.vmap(lambda times: simulate(Past(times=times), 0.0001, save="end", throw=False).final.x))(times)
    is_clear = np.abs((times[:, 3] + 4.2) % 0.7) > 1e-3  # the clock does not tick again in the run
    np.testing.assert_allclose(found[is_clear], [exactly(row) for row in times[is_clear]], rtol=1e-12)


class Timer(Component):
    """Each turn sets the time of the next one, and of a pause within it."""

    period: Param[Scalar, "s"]
    share: Param[Scalar, "1"]
    due: Discrete[Scalar, "s"] = -2.5
    pause: Discrete[Scalar, "s"] = -jnp.inf
    turns: Discrete[Scalar, "1"] = 0.0
    on: Discrete[Scalar, "1"] = 0.0
    x: Var[Scalar, "s"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, self.on))

    def events(self) -> Events:
        later = self.due + self.period
        return dict(
            pause=at(self.pause, on=0.0),
            turn=at(self.due, due=later, pause=self.due + self.share * self.period, on=1.0, turns=self.turns + 1.0),
        )


@pytest.mark.thorough
def test_past_events_schedule_past_events() -> None:
    """A run that starts late goes on as if it had been started in time."""
    rng = np.random.default_rng(7)
    periods, shares = rng.uniform(0.4, 3.0, 32), rng.uniform(0.05, 0.95, 32)

    def ends(period: Any, share: Any) -> Any:
        final = simulate(Timer(period=period, share=share), 2.0, save="end", throw=False).final
        return jnp.stack([final.turns, final.x])

    found = jax.jit(jax.vmap(ends))(periods, shares)
    starts = -2.5 + periods[:, None] * np.arange(20)
    on = np.clip(starts + (periods * shares)[:, None], 0.0, 2.0) - np.clip(starts, 0.0, 2.0)
    np.testing.assert_array_equal(found[:, 0], np.sum(starts <= 2.0, axis=1))
    np.testing.assert_allclose(found[:, 1], np.sum(on, axis=1), atol=1e-9)
