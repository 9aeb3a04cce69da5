"""Derivatives over bends of equations, wherever these lie."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Discrete, Equations, Events, Param, Scalar, Time, Var, at, eq, ifelse, simulate, when

BESIDE = [0.0, 1e-15, -1e-15, 1e-8, -1e-8, 1e-5, -1e-5, 1e-3, -1e-3, 0.03, -0.03]


def above(x: Any) -> Any:
    return ifelse(x > 0.0, x, 0.0)


class Swing(Component):
    """x swings as cos(w t), and q is the integral of what it is above c."""

    c: Param[Scalar, "1"]
    w: Param[Scalar, "1"]
    T: Param[Scalar, "s"]
    x: Var[Scalar, "1"] = 1.0
    v: Var[Scalar, "1"] = 0.0
    q: Var[Scalar, "1"] = 0.0
    n: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(
            x=eq(d.x, self.v, check_units=False),
            v=eq(d.v, -(self.w**2) * self.x, check_units=False),
            q=eq(d.q, above(self.x - self.c), check_units=False),
        )

    def events(self) -> Events:
        return dict(
            tick=at(self.T, n=self.n + 1.0),
            turn=when(self.v < -0.5 * self.w, n=self.n + 10.0),
        )


def exactly(c: Any, w: Any, T: Any, t1: Any) -> Any:
    del T
    phase = w * t1
    periods, edge = jnp.floor((phase + jnp.pi) / (2 * jnp.pi)), jnp.arccos(c)
    rest = jnp.clip(phase - 2 * jnp.pi * periods, -edge, edge)
    return (2 * periods * (jnp.sin(edge) - c * edge) + jnp.sin(rest) - c * rest) / w


@pytest.mark.thorough
@pytest.mark.parametrize("is_saved", [False, True])
@pytest.mark.parametrize(("rtol", "most"), [(1e-4, 5e-3), (1e-6, 2e-5)])
def test_derivatives_over_kinks_are_as_accurate_as_the_run(is_saved: bool, rtol: float, most: float) -> None:
    """Also where a kink lies beside an instant, the end of the run, or a time to save at."""

    def simulated(c: Any, w: Any, T: Any, t1: Any) -> Any:
        save = jnp.linspace(0.0, t1, 7) if is_saved else "end"
        return simulate(Swing(c=c, w=w, T=T), t1, save=save, rtol=rtol)["q"][-1]

    rng = np.random.default_rng(0)
    n = 200
    c, w = rng.uniform(-0.9, 0.9, n), rng.uniform(0.5, 3.0, n)
    bend, far = np.arccos(c) / w, rng.uniform(4.0, 8.0, n)
    instant = np.where(rng.random(n) < 0.5, bend + rng.choice(BESIDE, n), 50.0)
    end = np.where(rng.random(n) < 0.5, bend + rng.choice(BESIDE, n), far)
    slopes = jax.jit(jax.vmap(jax.jacfwd(simulated, argnums=(0, 1, 2))))(c, w, instant, end)
    exact = jax.vmap(jax.jacfwd(exactly, argnums=(0, 1, 2)))(c, w, instant, end)
    np.testing.assert_allclose(np.stack(slopes), np.stack(exact), atol=most)


@pytest.mark.thorough
@pytest.mark.parametrize("lead", [1e-2, 1e-6, 1e-12])
@pytest.mark.parametrize(("rtol", "most"), [(1e-4, 2e-3), (1e-6, 2e-5)])
def test_a_run_that_ends_just_before_a_kink_does_not_look_beyond_it(lead: float, rtol: float, most: float) -> None:
    def simulated(c: Any, w: Any) -> Any:
        model = Swing(c=c, w=w, T=50.0)
        return simulate(model, 20.0, until=lambda s: s.x - c - lead, save="end", rtol=rtol).final.q

    def exact(c: Any, w: Any) -> Any:
        return exactly(c, w, 0.0, jnp.arccos(c + lead) / w)

    rng = np.random.default_rng(1)
    c, w = rng.uniform(-0.8, 0.8, 100), rng.uniform(0.5, 3.0, 100)
    slopes = jax.jit(jax.vmap(jax.jacfwd(simulated, argnums=(0, 1))))(c, w)
    expected = jax.vmap(jax.jacfwd(exact, argnums=(0, 1)))(c, w)
    np.testing.assert_allclose(np.stack(slopes), np.stack(expected), atol=most)


class Filtered(Component):
    """x follows what t² is above T, and does so fast."""

    T: Param[Scalar, "1"]
    k: Param[Scalar, "1"]
    t: Time[Scalar, "s"] = 0.0
    x: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, above(self.t**2 - self.T) - self.k * self.x, check_units=False))


@pytest.mark.thorough
def test_a_step_that_goes_on_to_a_kink_has_the_derivatives_before_it() -> None:
    """Stiff states are corrected by rates, which change as they do before the kink."""

    def simulated(T: Any, k: Any, t: Any) -> Any:
        return simulate(Filtered(T=T, k=k), t + 0.3, save=jnp.stack([t]), rtol=1e-8)["x"][-1]

    def exact(T: Any, k: Any, t: Any) -> Any:
        def forced(t: Any) -> Any:
            return t * t / k - 2 * t / k**2 + 2 / k**3 - T / k

        return forced(t) - forced(jnp.sqrt(T)) * jnp.exp(-k * (t - jnp.sqrt(T)))

    rng = np.random.default_rng(0)
    T, k = rng.uniform(0.5, 4.0, 400), 10 ** rng.uniform(0.0, 2.5, 400)
    t = np.sqrt(T) + 10 ** rng.uniform(-3.0, -0.5, 400)
    slopes = jax.jit(jax.vmap(jax.grad(simulated)))(T, k, t)
    expected = jax.vmap(jax.grad(exact))(T, k, t)
    np.testing.assert_allclose(slopes, expected, atol=3e-6)


@pytest.mark.thorough
@pytest.mark.parametrize("mode", [jax.jacfwd, jax.jacrev])
def test_a_kink_costs_few_steps(mode: Any) -> None:
    """The run has 10 steps without one. Those around it are the trial beyond it, some that come nearer to it, each much
    shorter than the one before, and some that grow again behind it.
    """

    def simulated(c: Any) -> Any:
        sol = simulate(Swing(c=c, w=1.0, T=50.0), 3.0, save="end", rtol=1e-6)
        return sol.final.q, sol.stats["num_steps"]

    slope, steps = jax.jit(mode(simulated, has_aux=True))(0.3)
    _, smooth = simulated(-5.0)
    np.testing.assert_allclose(slope, -np.arccos(0.3), rtol=1e-6)
    assert steps <= smooth + 18


class Decay(Component):
    """y decays to where it is told from zero by rounding alone, and q is the integral of what is above zero."""

    a: Param[Scalar, "1/s"]
    y: Var[Scalar, "1"] = 1.0
    q: Var[Scalar, "s"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(y=eq(d.y, -self.a * self.y), q=eq(d.q, above(self.y)))


@pytest.mark.thorough
@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-8])
def test_what_has_decayed_to_a_kink_takes_long_steps(rtol: float) -> None:
    def simulated(a: Any) -> Any:
        sol = simulate(Decay(a=a), 3.0, save="end", rtol=rtol)
        return sol.final.q, sol.stats["num_steps"]

    a = 10.0 ** np.linspace(1.0, 6.0, 21)
    (q, slope), steps = jax.jit(
        jax.vmap(lambda a: (jax.jvp(lambda a: simulated(a)[0], (a,), (1.0,)), simulated(a)[1]))
    )(a)
    np.testing.assert_allclose(q * a, 1.0, atol=20 * rtol)
    np.testing.assert_allclose(slope * a**2, -1.0, atol=100 * rtol)
    assert np.max(steps) < 100
