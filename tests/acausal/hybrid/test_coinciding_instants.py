"""Conditions on time alone that change at one instant: the derivative by each of their times."""

from collections.abc import Callable
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Array, Component, Equations, Events, Param, Scalar, Time, Var, eq, ifelse, repeat, simulate, when
from components.blocks import Pulse, Step

MODES = [jax.jacfwd, jax.jacrev]
END = 2.0


def final(model: Component) -> Any:
    return simulate(model, END, save="end", rtol=1e-10).final


def differences(run: Callable[[Any], Any], at: Any, left: float = 1e-5, right: float = 1e-5) -> Any:
    """Differences of a function between `left` and `right` of a point in each direction."""
    compiled = jax.jit(run)
    parts = [compiled(at + right * e) - compiled(at - left * e) for e in jnp.eye(len(at))]
    return jnp.stack(parts) / (left + right)


class Driven(Component):
    """A nonlinear state with three inputs that step."""

    u: Step
    v: Step
    w: Step
    x: Var[Scalar, ""] = 0.3

    def equations(self, d: Self) -> Equations:
        u, v, w = self.u.y.value, self.v.y.value, self.w.y.value
        return dict(x=eq(d.x, u * self.x - v * self.x**2 + jnp.cos(w * self.x), check_units=False))


class Held(Component):
    """The same state, with all conditions in its equation."""

    a: Param[Scalar, "s"]
    b: Param[Scalar, "s"]
    c: Param[Scalar, "s"]
    t: Time[Scalar, "s"] = 0.0
    x: Var[Scalar, ""] = 0.3

    def equations(self, d: Self) -> Equations:
        u, v = ifelse(self.t < self.a, 0.0, 1.5), ifelse(self.t < self.b, 0.0, 0.7)
        w = ifelse(self.t >= self.c, 2.0, 0.0)
        return dict(x=eq(d.x, u * self.x - v * self.x**2 + jnp.cos(w * self.x), check_units=False))


class Reset(Component):
    """Two states that are set at times, and one that is switched on."""

    a: Param[Scalar, "s"]
    b: Param[Scalar, "s"]
    c: Param[Scalar, "s"]
    t: Time[Scalar, "s"] = 0.0
    x: Var[Scalar, ""] = 0.3
    y: Var[Scalar, ""] = 1.0

    def equations(self, d: Self) -> Equations:
        pull = jnp.where(self.t < self.c, 0.0, 1.0)
        return dict(x=eq(d.x, -2.0 * self.x, check_units=False), y=eq(d.y, -self.y - pull, check_units=False))

    def events(self) -> Events:
        return dict(x=when(self.t > self.a, x=self.x + 1.0), y=when(self.t >= self.b, y=0.5 * self.y))


def driven(times: Any) -> Any:
    u, v, w = (Step(height=h, start_time=time) for h, time in zip((1.5, 0.7, 2.0), times, strict=True))
    return final(Driven(u=u, v=v, w=w)).x


def held(times: Any) -> Any:
    return final(Held(**dict(zip("abc", times, strict=True)))).x


def reset(times: Any) -> Any:
    found = final(Reset(**dict(zip("abc", times, strict=True))))
    return found.x + 2.0 * found.y


@pytest.mark.thorough
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("run", [driven, held])
def test_gradient_by_each_of_three_equal_times(run: Callable[[Any], Any], mode: Any) -> None:
    times = jnp.ones(3)
    found = jax.jit(mode(run))(times)
    np.testing.assert_allclose(found, differences(run, times), rtol=1e-5)
    together = jax.jit(mode(lambda time: run(time * times)))(1.0)
    np.testing.assert_allclose(together, differences(lambda time: run(time[0] * times), jnp.ones(1))[0], rtol=1e-5)


@pytest.mark.thorough
@pytest.mark.parametrize("mode", MODES)
def test_gradient_by_each_of_three_equal_times_of_resets(mode: Any) -> None:
    """x is increased by 1 at a, y halved at b; y' = -y - 1 from c."""
    by_a, by_b, by_c = 2.0 * np.exp(-2.0), np.exp(-1.0), np.exp(-1.0)  # with c not later than b
    np.testing.assert_allclose(jax.jit(mode(reset))(jnp.ones(3)), [by_a, by_b, by_c], rtol=1e-8)


@pytest.mark.thorough
@pytest.mark.parametrize("mode", MODES)
def test_gradient_of_a_run_backwards(mode: Any) -> None:
    def run(times: Any) -> Any:
        u, v = (Step(height=h, start_time=time) for h, time in zip((1.5, 0.7), times, strict=True))
        return simulate(Driven(u=u, v=v, w=Step(height=2.0)), 0.5, t0=END, save="end", rtol=1e-10).final.x

    times = jnp.ones(2)
    np.testing.assert_allclose(jax.jit(mode(run))(times), differences(run, times), rtol=1e-5)


@pytest.mark.thorough
@pytest.mark.parametrize("mode", MODES)
def test_a_batch_of_times_that_pass_each_other(mode: Any) -> None:
    passing = jnp.array([0.9, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 1.2])
    times = jnp.stack([passing, jnp.ones(5), passing[::-1]], axis=1)
    gradients = jax.jit(jax.vmap(mode(driven)))
    np.testing.assert_allclose(gradients(times), gradients(times + jnp.array([0.0, 1e-8, 2e-8])), rtol=1e-6)


class Growth(Component):
    """x' = rate x from a time."""

    start: Param[Scalar, "s"]
    rate: Param[Scalar, "1/s"]
    t: Time[Scalar, "s"] = 0.0
    x: Var[Scalar, "1"] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, jnp.where(self.t < self.start, 0.0, self.rate) * self.x))


class Grown(Component):
    """Several of them: one program evaluates all."""

    parts: Array[Growth]


@pytest.mark.thorough
@pytest.mark.parametrize("mode", MODES)
def test_members_of_an_array(mode: Any) -> None:
    rates = jnp.linspace(0.5, 1.5, 6)
    found = mode(lambda times: final(Grown(parts=repeat(Growth(start=times, rate=rates), 6))).parts[:].x)(jnp.ones(6))
    np.testing.assert_allclose(found, jnp.diag(-rates * jnp.exp(rates)), rtol=1e-7, atol=1e-9)


class Loop(Component):
    """The product of two unknowns that conditions on time and equations determine together."""

    a: Param[Scalar, "s"]
    b: Param[Scalar, "s"]
    t: Time[Scalar, "s"] = 0.0
    u: Var[Scalar, "1"] = 0.0
    v: Var[Scalar, "1"] = 0.0
    x: Var[Scalar, "s"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(
            u=eq(self.u + 0.3 * jnp.sin(self.v), jnp.where(self.t < self.a, 0.0, 1.0)),
            v=eq(self.v - 0.2 * self.u**3, jnp.where(self.t < self.b, 0.1, 1.0)),
            x=eq(d.x, self.u * self.v),
        )


@pytest.mark.thorough
@pytest.mark.parametrize("mode", MODES)
def test_one_sided_derivatives_if_the_changes_are_not_additive(mode: Any) -> None:
    """With the first condition first: a is not later than b."""

    def run(times: Any) -> Any:
        return final(Loop(a=times[0], b=times[1])).x

    times = jnp.ones(2)
    before, after = differences(run, times, right=0.0), differences(run, times, left=0.0)
    assert jnp.min(jnp.abs(before - after)) > 0.1
    np.testing.assert_allclose(jax.jit(mode(run))(times), [before[0], after[1]], rtol=1e-5)


class Waves(Component):
    """The integral of two rectangular waves with common edges."""

    p: Pulse
    q: Pulse
    x: Var[Scalar, "s"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, 2.0 * self.p.y.value - 3.0 * self.q.y.value))


@pytest.mark.parametrize("mode", MODES)
def test_waves_that_coincide_in_every_period(mode: Any) -> None:
    def run(numbers: Any) -> Any:
        start, p, q, width = numbers
        waves = Waves(p=Pulse(amplitude=1.0, period=p, start_time=start), q=Pulse(amplitude=1.0, period=q, width=width))
        return simulate(waves, 2.1, save="end").final.x

    # Until 2.1, p rises at 0.25 + k / 2 and falls 1 / 4 later, k = 0 to 3 (the last time without a fall before 2.25 for
    # k = 4); q rises at k / 4, k = 0 to 8, and falls 1 / 8 later, k = 0 to 7.
    numbers = jnp.array([0.25, 0.5, 0.25, 0.5])
    k, m = np.arange(4.0), np.arange(8.0)
    by_p = 2.0 * np.sum(k + 0.5 - k)
    by_q = -3.0 * (np.sum(m + 0.5) - np.sum(np.arange(9.0)))
    np.testing.assert_allclose(mode(run)(numbers), [0.0, by_p, by_q, -3.0 * 8.0 * 0.25], rtol=1e-9, atol=1e-12)
