"""Trajectories and stop times against closed forms."""

from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _models import RC, gear_train, oscillator, rc
from jaxtyping import Array, Float

from acausal import (
    Component,
    Connections,
    Result,
    Rodas3P,
    Rodas5P,
    connect,
    simulate,
)
from components.translational import Fixed, Mass, Spring

TIMES = np.linspace(0.0, 0.25, 6)
CHARGE = 5.0 * (1.0 - np.exp(-10.0 * TIMES))


@pytest.mark.thorough
def test_rc_charges() -> None:
    sol = simulate(rc(), 0.25, save=TIMES, rtol=1e-10)
    np.testing.assert_allclose(sol.ts, TIMES)
    np.testing.assert_allclose(sol["c.v"], CHARGE, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(sol["r.i"], (5.0 - CHARGE) / 100.0, rtol=1e-7)
    np.testing.assert_allclose(sol["source.p.i"], -(5.0 - CHARGE) / 100.0, rtol=1e-7)
    assert sol.result == Result.reached_end
    assert sol.t1 == 0.25


@pytest.mark.parametrize(
    "solver", [Rodas3P(), diffrax.Kvaerno5(), Rodas5P(unroll=True)], ids=["Rodas3P", "Kvaerno5", "unrolled"]
)
def test_other_solvers_agree(solver: diffrax.AbstractSolver) -> None:
    sol = simulate(rc(), 0.25, save=TIMES, rtol=1e-10, solver=solver)
    np.testing.assert_allclose(sol["c.v"], CHARGE, rtol=1e-7, atol=1e-9)


@pytest.mark.thorough
@pytest.mark.parametrize("solver", [diffrax.Tsit5(), diffrax.Kvaerno5()], ids=["Tsit5", "Kvaerno5"])
def test_other_solvers_stop_at_the_same_time(solver: diffrax.AbstractSolver) -> None:
    def time(resistance: Any) -> Any:
        return simulate(rc(R=resistance), 1.0, until=lambda s: s.c.v - 2.0, save="end", rtol=1e-9, solver=solver).t1

    expected = -1e-3 * np.log(0.6)  # times the resistance
    for mode in (jax.jvp(time, (100.0,), (1.0,)), jax.value_and_grad(time)(100.0)):
        np.testing.assert_allclose(mode, (100.0 * expected, expected), rtol=1e-6)  # Kvaerno5 iterates


def damped(t: Any, m: float, c: float, d: float, s0: float, v0: float) -> np.ndarray:
    """Position of an underdamped oscillator."""
    decay, omega = d / (2 * m), np.sqrt(c / m - (d / (2 * m)) ** 2)
    t = np.asarray(t)
    return np.exp(-decay * t) * (s0 * np.cos(omega * t) + (v0 + decay * s0) / omega * np.sin(omega * t))


@pytest.mark.thorough
def test_damped_oscillator_dense() -> None:
    numbers = dict(m=2.0, c=50.0, d=4.0, s0=0.03, v0=-0.4)
    sol = simulate(oscillator(**numbers), 2.0, save="dense", rtol=1e-9)
    times = np.random.default_rng(0).uniform(0.0, 2.0, 50)
    np.testing.assert_allclose(sol.at(times).mass.a.s, damped(times, **numbers), atol=2e-8)
    np.testing.assert_allclose(sol.at(0.7).mass.a.s, damped(0.7, **numbers), atol=2e-8)


class Coupled(Component):
    """Two equal masses between three equal springs."""

    masses: tuple[Mass, Mass]
    springs: tuple[Spring, Spring, Spring]
    walls: tuple[Fixed, Fixed] = (Fixed(), Fixed())

    def connections(self) -> Connections:
        (a, b), (left, middle, right) = self.masses, self.springs
        return (
            connect(self.walls[0].flange, left.a),
            connect(left.b, a.a),
            connect(a.b, middle.a),
            connect(middle.b, b.a),
            connect(b.b, right.a),
            connect(right.b, self.walls[1].flange),
        )


def test_coupled_oscillators() -> None:
    """A start in the first mass alone excites both modes, sqrt(c/m) and sqrt(3 c/m), alike."""
    c, m, v0 = 8.0, 2.0, 0.3
    model = Coupled(masses=(Mass(m=m, v=v0), Mass(m=m)), springs=(Spring(c=c), Spring(c=c), Spring(c=c)))
    sol = simulate(model, 5.0, rtol=1e-9)
    slow, fast = np.sqrt(c / m), np.sqrt(3 * c / m)
    t = np.asarray(sol.ts)
    assert len(t) > 10
    first = v0 / 2 * (np.sin(slow * t) / slow + np.sin(fast * t) / fast)
    second = v0 / 2 * (np.sin(slow * t) / slow - np.sin(fast * t) / fast)
    np.testing.assert_allclose(sol["masses[0].a.s"], first, atol=2e-8)
    np.testing.assert_allclose(sol["masses[1].a.s"], second, atol=2e-8)


def test_gear_train() -> None:
    ratio, torque = -3.0, 2.0
    sol = simulate(gear_train(ratio, torque=torque), 2.0, save="end", rtol=1e-9)
    acceleration = torque / (1.5 + 4.0 / ratio**2)
    np.testing.assert_allclose(sol.final.first.w, 2.0 * acceleration, rtol=1e-9)
    np.testing.assert_allclose(sol.final.second.a.phi, 2.0 * acceleration / ratio, rtol=1e-9)
    # The gear passes what accelerates the second rotor.
    np.testing.assert_allclose(sol.final.gear.a.tau, 4.0 / ratio**2 * acceleration, rtol=1e-9)


def test_runs_backwards() -> None:
    """The capacitor at -0.1 s, if it is empty at 0."""
    sol = simulate(rc(), -0.1, save="end", rtol=1e-9)
    np.testing.assert_allclose(sol.final.c.v, 5.0 * (1.0 - np.exp(1.0)), rtol=1e-7)


# --- stop conditions -------------------------------------------------------------------------------------------------


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("direction", "expected"), [("up", 13 * np.pi / 6), ("down", 5 * np.pi / 6), (None, 5 * np.pi / 6)]
)
def test_stop_direction(direction: Any, expected: float) -> None:
    """s = cos(t - pi/3): above 1/2 only after the start, below from 2 pi/3 on."""
    model = oscillator(s0=np.sin(np.pi / 3), v0=np.cos(np.pi / 3))
    sol = simulate(model, 10.0, until=lambda s: s.mass.a.s - 0.5, direction=direction, rtol=1e-10, save="end")
    np.testing.assert_allclose(sol.t1 + np.pi / 3, expected, rtol=1e-9)
    assert sol.result == Result.stopped
    np.testing.assert_allclose(sol.final.mass.a.s, 0.5, atol=1e-9)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("direction", "expected"), [("up", Result.stopped), (None, Result.stopped), ("down", Result.never_stopped)]
)
def test_stop_at_the_start(direction: Any, expected: Result) -> None:
    """A condition that is zero at the start is met there, except by a fall."""
    sol = simulate(rc(), 0.25, until=lambda s: s.c.v, direction=direction, save="end", throw=False)
    assert sol.result == expected
    assert sol.t1 == (0.0 if expected == Result.stopped else np.inf)


@pytest.mark.thorough
def test_stops_of_a_batch() -> None:
    """Some runs of a batch are stopped, others are not; so are their derivatives."""

    def stop(R: Array) -> Array:
        model = eqx.tree_at(lambda m: m.r.R, rc(), R)
        t1 = simulate(model, 0.1, until=lambda s: s.c.v - 2.5, rtol=1e-10, save="end", throw=False).t1
        return jnp.where(jnp.isfinite(t1), t1, 0.0)

    R, is_stopped = jnp.array([50.0, 200.0, 100.0]), np.array([True, False, True])
    times, slopes = jax.vmap(jax.value_and_grad(stop))(R)
    np.testing.assert_allclose(times, np.where(is_stopped, R * 1e-3 * np.log(2.0), 0.0), rtol=1e-8)
    np.testing.assert_allclose(slopes, np.where(is_stopped, 1e-3 * np.log(2.0), 0.0), rtol=1e-7)


@pytest.mark.thorough
def test_condition_that_jumps() -> None:
    """A condition that changes sign by a jump is met where it jumps."""
    sol = simulate(rc(), 1.0, until=lambda s: jnp.where(s.c.v > 1.0, 1.0, -1.0), rtol=1e-9, save="end")
    np.testing.assert_allclose(sol.t1, -0.1 * np.log(0.8), rtol=1e-6)


def stop_time(numbers: Float[Array, "5"]) -> Any:
    """t1 as a function of R, C, V, the start value and the voltage at which to stop."""
    R, C, V, v0, limit = numbers
    model = eqx.tree_at(lambda m: (m.r.R, m.c.C, m.source.V, m.c.v), rc(), (R, C, V, v0))
    return simulate(model, 5.0, until=lambda s: s.c.v - limit, rtol=1e-10, save="end", throw=False).t1


def exact_stop_time(numbers: Any) -> Any:
    R, C, V, v0, limit = numbers
    return R * C * jnp.log((V - v0) / (V - limit))


POINT = jnp.array([120.0, 2e-3, 6.0, 0.5, 4.0])
jitted_stop_time = jax.jit(stop_time)
stop_times = jax.jit(jax.vmap(stop_time))


@pytest.mark.thorough
def test_stop_time_forward_mode() -> None:
    value, slope = jax.jit(lambda p: (stop_time(p), jax.jacfwd(stop_time)(p)))(POINT)
    np.testing.assert_allclose(value, exact_stop_time(POINT), rtol=1e-9)
    np.testing.assert_allclose(slope, jax.jacfwd(exact_stop_time)(POINT), rtol=1e-7)


@pytest.fixture(scope="module")
def reverse() -> Any:
    return jax.jit(jax.value_and_grad(stop_time))


def test_stop_time_reverse_mode(reverse: Any) -> None:
    value, slope = reverse(POINT)
    np.testing.assert_allclose(value, exact_stop_time(POINT), rtol=1e-9)
    np.testing.assert_allclose(slope, jax.grad(exact_stop_time)(POINT), rtol=1e-7)


@pytest.mark.thorough
def test_stop_time_finite_differences(reverse: Any) -> None:
    steps = jnp.diag(1e-4 * POINT)
    ahead, behind = stop_times(POINT + steps), stop_times(POINT - steps)
    np.testing.assert_allclose((ahead - behind) / (2e-4 * POINT), reverse(POINT)[1], rtol=1e-6)


def test_never_stopped_has_a_finite_gradient(reverse: Any) -> None:
    value, slope = reverse(POINT.at[4].set(6.5))
    assert value == jnp.inf
    np.testing.assert_array_equal(slope, 0.0)


@pytest.mark.thorough
def test_vmap_equals_loop() -> None:
    points = POINT * jnp.linspace(0.9, 1.1, 4)[:, None]
    np.testing.assert_allclose(stop_times(points), [jitted_stop_time(p) for p in points], rtol=1e-12)


@pytest.mark.thorough
def test_filter_grad_over_the_model() -> None:
    def at_end(model: RC) -> Any:
        return simulate(model, 0.1, save="end", rtol=1e-10).final.c.v

    gradient = eqx.filter_grad(at_end)(rc(v0=1.0))
    slope = (1.0 - 5.0) * np.exp(-1.0)  # by -t / (R C)
    np.testing.assert_allclose(gradient.r.R, slope * 0.1 / (100.0**2 * 1e-3), rtol=1e-7)
    np.testing.assert_allclose(gradient.c.C, slope * 0.1 / (100.0 * 1e-3**2), rtol=1e-7)
    np.testing.assert_allclose(gradient.source.V, 1.0 - np.exp(-1.0), rtol=1e-7)
    assert gradient.c.v is None  # a start value given as a plain number is not differentiated


def at_end(numbers: Float[Array, "4"]) -> Any:
    """The voltage at the end as a function of R, the start value, t0 and t1."""
    R, v0, t0, t1 = numbers
    model = eqx.tree_at(lambda m: (m.r.R, m.c.v), rc(), (R, v0))
    return simulate(model, t1, t0=t0, rtol=1e-10, save="end").final.c.v


def exact_at_end(numbers: Any) -> Any:
    R, v0, t0, t1 = numbers
    return 5.0 + (v0 - 5.0) * jnp.exp(-(t1 - t0) / (R * 1e-3))


@pytest.mark.thorough
@pytest.mark.parametrize("mode", [jax.jacfwd, jax.jacrev])
def test_derivative_by_times_and_start_value(mode: Any) -> None:
    point = jnp.array([80.0, 1.5, 0.3, 0.4])
    np.testing.assert_allclose(jax.jit(at_end)(point), exact_at_end(point), rtol=1e-9)
    np.testing.assert_allclose(jax.jit(mode(at_end))(point), jax.grad(exact_at_end)(point), rtol=1e-6)
