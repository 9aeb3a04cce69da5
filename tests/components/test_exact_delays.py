"""Exact delays: the method of steps, jumps that return, derivatives, and what a model with a delay cannot do."""

import itertools
from typing import Any, Self

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig
from scipy.special import factorial, lambertw

from acausal import (
    ROW,
    Array,
    Component,
    Connections,
    Discrete,
    Equations,
    Events,
    ModelError,
    Scalar,
    SimulationError,
    Time,
    Var,
    Vector,
    connect,
    eq,
    linearise,
    recall,
    remember,
    shape,
    simulate,
    stack,
)
from acausal.codegen import export_c
from components import blocks

TIMES = np.array([0.5, 1.5, 2.5, 3.7, 5.2, 7.3])


def loop(gain: Any, integrator: Any, delay: Any) -> Connections:
    """dx/dt = -k x(t - T)."""
    return connect(gain.y, integrator.u), connect(integrator.y, delay.u), connect(delay.y, gain.u)


def chain(*parts: Any) -> Connections:
    return tuple(connect(one.y, other.u) for one, other in itertools.pairwise(parts))


def delayed_loop(T: Scalar = 1.0, k: Scalar = 1.0, n: int = 64) -> Rig:
    return Rig(parts=(blocks.Gain(k=-k), blocks.Integrator(x=1.0), blocks.FixedDelay(T=T, n=n)), wiring=loop)


def by_steps(t: Any, T: Any = 1.0, k: Any = 1.0) -> Any:
    """The solution of dx/dt = -k x(t - T) with x = 1 up to the start, a polynomial in each interval of length T."""
    return sum((-k) ** i * jnp.maximum(t - (i - 1) * T, 0.0) ** i / factorial(i) for i in range(10))


@pytest.mark.parametrize("rtol", [1e-4, 1e-9])
def test_the_solution_by_the_method_of_steps(rtol: float) -> None:
    """Steps end at the breaking points, so that the polynomials of low degree of the first intervals are exact."""
    solution = simulate(delayed_loop(), 7.3, rtol=rtol, save=TIMES)
    error = np.abs(np.asarray(solution["parts[1].x"]) - np.asarray(by_steps(TIMES)))
    assert np.all(error[:4] < 1e-12)
    assert np.all(error < rtol)


@pytest.mark.thorough
def test_the_interpolation_error_follows_the_tolerance() -> None:
    """No state resolves the sine. The number of steps grows with the fifth root of the accuracy."""
    w, t = 20.0, np.array([1.0, 2.0, 3.0])
    delay = blocks.FixedDelay(T=0.7, n=256)
    model = Rig(parts=(blocks.Sine(amplitude=1.0, frequency=w / (2.0 * np.pi)), delay), wiring=chain)
    steps = []
    for rtol in (1e-6, 1e-8, 1e-10):
        solution = simulate(model, 3.0, rtol=rtol, save=t)
        assert np.max(np.abs(np.asarray(solution["parts[1].y.value"]) - np.sin(w * (t - 0.7)))) < 2.0 * rtol
        steps.append(int(solution.stats["num_steps"]))
    for few, many in itertools.pairwise(steps):
        assert many / few < 1.1 * 100.0**0.2


@pytest.mark.thorough
@pytest.mark.parametrize("kT", [1.2, 0.5 * np.pi, 1.7])
def test_a_loop_decays_up_to_the_limit_of_stability(kT: float) -> None:
    """The slowest pole of dx/dt = -k x(t - T) is W(-k T)/T: on the imaginary axis for k T = pi/2."""
    T, h = 0.2, 0.1
    pole = lambertw(-kT, 0) / T
    solution = simulate(delayed_loop(T, kT / T), 6.0 + 2.0 * h, rtol=1e-9, save=6.0 + h * np.arange(3))
    x = np.asarray(solution["parts[1].x"])
    turned = np.exp(pole * h)
    assert x[2] == pytest.approx(2.0 * turned.real * x[1] - abs(turned) ** 2 * x[0], abs=2e-8 * max(1.0, *np.abs(x)))


def pulsed(step: Any, total: Any, delay: Any, gain: Any, integrator: Any) -> Connections:
    back = connect(delay.y, gain.u), connect(gain.y, total.u2)
    return connect(step.y, total.u1), connect(total.y, delay.u, integrator.u), *back


@pytest.mark.thorough
def test_a_jump_returns_with_half_its_height_after_each_delay() -> None:
    """u = step - u(t - T)/2 has no state in its loop; the integral of the stairs is exact."""

    def end(T: Scalar, start: Scalar) -> Scalar:
        step, gain = blocks.Step(start_time=start, height=1.0), blocks.Gain(k=-0.5)
        parts = (step, blocks.Sum(), blocks.FixedDelay(T=T), gain, blocks.Integrator())
        return simulate(Rig(parts=parts, wiring=pulsed), 3.0, rtol=1e-6, save="end").final.parts[4].x

    def exact(T: Scalar, start: Scalar) -> Scalar:
        return sum((-0.5) ** i * (3.0 - start - i * T) for i in range(6))

    value, slopes = jax.value_and_grad(lambda p: end(*p))(jnp.array([0.5, 0.25]))
    assert value == pytest.approx(exact(0.5, 0.25), abs=1e-13)
    assert slopes == pytest.approx(np.asarray(jax.grad(lambda p: exact(*p))(jnp.array([0.5, 0.25]))), abs=1e-12)


class TwoLoops(Component):
    """Two loops without a state, the second of which reads the first."""

    step: blocks.Step
    first: blocks.WeightedSum
    second: blocks.WeightedSum
    short: blocks.FixedDelay
    long: blocks.FixedDelay
    integral: blocks.Integrator

    def connections(self) -> Connections:
        return (
            connect(self.step.y, self.first.u[0], self.second.u[0]),
            connect(self.first.y, self.short.u),
            connect(self.second.y, self.long.u),
            connect(self.short.y, self.first.u[1], self.second.u[2]),
            connect(self.long.y, self.second.u[1], self.integral.u),
        )


@pytest.mark.thorough
def test_jumps_that_return_together_after_one_long_delay_and_thirty_short_ones() -> None:
    """In 6 s, jumps happen 590 times; the sums of 600 delays of 0.01 s and of 20 of 0.3 s differ by many roundings."""
    start, end, short, long = 0.1, 6.0, 0.01, 0.3
    model = TwoLoops(
        step=blocks.Step(start_time=start, height=1.0),
        first=blocks.WeightedSum(k=[1.0, -0.999]),
        second=blocks.WeightedSum(k=[1.0, -0.99, 0.5]),
        short=blocks.FixedDelay(T=short),
        long=blocks.FixedDelay(T=long),
        integral=blocks.Integrator(),
    )
    solution = simulate(model, end, save="end")
    left = end - start - long * np.arange(1.0, 21.0)
    of_first = np.maximum(left[:, None] - short * np.arange(1.0, 601.0), 0.0) @ (-0.999) ** np.arange(600)
    exact = np.sum((-0.99) ** np.arange(20) * (np.maximum(left, 0.0) + 0.5 * of_first))
    assert solution.final.integral.x == pytest.approx(exact, abs=1e-9)
    assert solution.stats["num_steps"] < 620


@pytest.mark.thorough
@pytest.mark.parametrize("periods", [1.0, 2.0, 0.5, 1.0 / 3.0])
def test_jumps_that_return_with_the_jumps_of_a_pulse(periods: float) -> None:
    """u = pulse + u(t - T)/2 over 100 periods. Jumps that coincide are one event, so there are as many steps as jumps
    at different times; the derivatives are those of the geometric series, in both modes.
    """
    P, T = 0.1, 0.1 * periods

    def run(numbers: Any, end: float, **options: Any) -> Any:
        gain, period, delay = numbers
        source = blocks.Pulse(amplitude=1.0, period=period)
        parts = (source, blocks.Sum(), blocks.FixedDelay(T=delay, steady=False), blocks.Gain(k=gain))
        return simulate(Rig(parts=(*parts, blocks.Integrator()), wiring=pulsed), end, **options)

    t = P * (0.02 + 0.25 * np.arange(400))
    i = np.arange(60)
    ago = t[:, None] - i * T
    pulses = np.where(ago > 0.0, np.mod(ago, P) < 0.5 * P, 0.0)
    solution = run((0.5, P, T), 100.0 * P, save=t)
    assert solution["parts[1].y.value"] == pytest.approx(pulses @ 0.5**i, abs=1e-12)
    assert solution.stats["num_steps"] < (650 if periods < 0.5 else 220)

    end = 30.25 * P

    def integral(numbers: Any) -> Scalar:
        return run(numbers, end, save="end").final.parts[4].x

    def exact(numbers: Any) -> Scalar:
        gain, period, delay = numbers
        left = jnp.maximum(end - i * delay, 0.0)
        n = jnp.floor(left / period + 1e-9)
        return jnp.sum(gain**i * (0.5 * period * n + jnp.minimum(left - period * n, 0.5 * period)))

    numbers = jnp.array([0.5, P, T])
    slopes = np.asarray(jax.grad(exact)(numbers))
    assert integral(numbers) == pytest.approx(float(exact(numbers)), abs=1e-12)
    assert jax.grad(integral)(numbers) == pytest.approx(slopes, abs=1e-9)
    assert jax.jacfwd(integral)(numbers) == pytest.approx(slopes, abs=1e-9)


class Paths(Component):
    """Jumps of a step take many ways through two delays, around a loop without a state."""

    step: blocks.Step
    first: blocks.WeightedSum
    second: blocks.WeightedSum
    a: blocks.FixedDelay
    b: blocks.FixedDelay
    total: blocks.WeightedSum
    integral: blocks.Integrator

    def connections(self) -> Connections:
        return (
            connect(self.step.y, self.first.u[0], self.second.u[0]),
            connect(self.first.y, self.a.u),
            connect(self.second.y, self.b.u),
            connect(self.a.y, self.second.u[1], self.total.u[0]),
            connect(self.b.y, self.first.u[1], self.total.u[1]),
            connect(self.total.y, self.integral.u),
        )


LENGTHS = [(0.5, 0.7, 0.3), (0.5, 0.3, 0.7), (0.5, 0.5, 0.5), (0.25, 0.25, 0.5), (0.1, 0.2, 0.1), (1.0, 0.5, 0.25)]
LENGTHS += [(0.3, 0.2, 0.3), (0.5, 0.7001, 0.3)]


@pytest.mark.thorough
def test_derivatives_by_round_delays() -> None:
    """Jumps return at one instant on several ways, and with breaks of no height from the start of the run. The exact
    integral is a sum over all ways, in which the time of each jump is a sum of delays. One batch has all lengths
    without and with a way back.
    """
    height, into, of_a, of_b, end = 2.0, 0.4, 0.3, 1.0, 3.03

    def run(p: Any, loop: Any) -> Scalar:
        start, a, b = p
        model = Paths(
            step=blocks.Step(start_time=start, height=height),
            first=blocks.WeightedSum(k=[1.0, loop]),
            second=blocks.WeightedSum(k=[into, 1.0]),
            a=blocks.FixedDelay(T=a),
            b=blocks.FixedDelay(T=b),
            total=blocks.WeightedSum(k=[of_a, of_b]),
            integral=blocks.Integrator(),
        )
        return simulate(model, end, save="end").final.integral.x

    def exact(p: Any, loop: Any) -> Scalar:
        start, a, b = p
        n = jnp.arange(12)

        def reached(n_a: Any, n_b: Any) -> Any:
            return jnp.maximum(end - start - n_a * a - n_b * b, 0.0)

        from_first, from_second = loop**n, into * loop ** (n + 1.0)  # jumps of the first sum, on their way around
        of_first = from_first @ reached(n + 1, n) + from_second @ reached(n + 1, n + 1)
        of_second = into * reached(0, 1) + from_first @ reached(n + 1, n + 1) + from_second @ reached(n + 1, n + 2)
        return height * (of_a * of_first + of_b * of_second)

    cases = jnp.array(2 * LENGTHS), jnp.repeat(jnp.array([0.0, -0.6]), len(LENGTHS))
    expected, slopes = (np.asarray(item) for item in jax.vmap(jax.value_and_grad(exact))(*cases))
    values, reverse = jax.jit(jax.vmap(jax.value_and_grad(run)))(*cases)
    assert values == pytest.approx(expected, abs=1e-11)
    assert reverse == pytest.approx(slopes, abs=1e-9)
    assert jax.jit(jax.vmap(jax.jacfwd(run)))(*cases) == pytest.approx(slopes, abs=1e-9)


@pytest.mark.thorough
def test_derivatives_of_a_product_of_jumps_that_return_together() -> None:
    """x' = u(t - a) u(t - b) begins at the later of two times. If they are equal, the derivatives are those for one
    order of them.
    """

    def wiring(step: Any, a: Any, b: Any, product: Any, integral: Any) -> Connections:
        into, out = connect(step.y, a.u, b.u), connect(product.y, integral.u)
        return into, connect(a.y, product.u1), connect(b.y, product.u2), out

    def end(p: Any) -> Scalar:
        delays = blocks.FixedDelay(T=p[1]), blocks.FixedDelay(T=p[2])
        parts = (blocks.Step(start_time=p[0], height=1.0), *delays, blocks.Product(), blocks.Integrator())
        return simulate(Rig(parts=parts, wiring=wiring), 3.0, save="end").final.parts[4].x

    points = jnp.array([[0.5, 0.3, 0.7], [0.5, 0.7, 0.3], [0.5, 0.7, 0.7]])
    later, earlier, equal = jax.jit(jax.vmap(jax.jacfwd(end)))(points)
    assert later == pytest.approx(np.array([-1.0, 0.0, -1.0]), abs=1e-9)
    assert earlier == pytest.approx(np.array([-1.0, -1.0, 0.0]), abs=1e-9)
    assert any(equal == pytest.approx(np.asarray(one), abs=1e-9) for one in (later, earlier))


@pytest.mark.thorough
def test_a_relay_with_a_delay_makes_a_triangle() -> None:
    """dx/dt = -1 if x(t - T) > 0, otherwise 1: the amplitude is T, the period 4 T."""

    def wiring(integrator: Any, delay: Any, zero: Any, relay: Any, one: Any, total: Any) -> Connections:
        sign = connect(delay.y, relay.u1), connect(zero.y, relay.u2), connect(one.y, total.u1)
        return connect(integrator.y, delay.u), *sign, connect(relay.y, total.u2), connect(total.y, integrator.u)

    parts = (blocks.Integrator(x=0.3), blocks.FixedDelay(T=1.0), blocks.Constant(k=0.0), blocks.Comparator())
    parts += (blocks.Constant(k=1.0), blocks.Sum(k2=-2.0))
    x = simulate(Rig(parts=parts, wiring=wiring), 9.3, rtol=1e-9, save=1.3 + np.arange(9.0))["parts[0].x"]
    assert x == pytest.approx(np.resize([-1.0, 0.0, 1.0, 0.0], 9), abs=1e-8)


@pytest.mark.thorough
def test_derivatives_of_a_loop_in_both_modes_and_batches() -> None:
    def end(p: Any, adjoint: Any = None) -> Scalar:
        return simulate(delayed_loop(*p), 3.3, rtol=1e-9, save="end", adjoint=adjoint).final.parts[1].x

    def exact(p: Any) -> Scalar:
        return by_steps(3.3, *p)

    points = jnp.array([[1.0, 1.0], [0.6, 1.3], [1.7, 0.8]])
    expected = np.asarray(jax.vmap(jax.grad(exact))(points))
    values, slopes = jax.jit(jax.vmap(jax.value_and_grad(end)))(points)
    assert values == pytest.approx(np.asarray(jax.vmap(exact)(points)), abs=1e-9)
    assert slopes == pytest.approx(expected, abs=1e-8)
    assert jax.grad(end)(points[1], diffrax.DirectAdjoint()) == pytest.approx(expected[1], abs=1e-8)
    # The second derivative by T is that of the polynomials of the history, which are less accurate.
    assert jax.hessian(end)(points[1]) == pytest.approx(np.asarray(jax.hessian(exact)(points[1])), abs=1e-5)


@pytest.mark.thorough
def test_a_run_continues_with_its_history() -> None:
    half = simulate(delayed_loop(), 3.1, rtol=1e-8)
    whole = simulate(half.final, 7.3, t0=half.t1, resume=True, rtol=1e-8)
    assert whole.final.parts[1].x == pytest.approx(float(by_steps(7.3)), abs=1e-8)


@pytest.mark.thorough
def test_before_the_start_the_signal_was_constant_or_the_given_value() -> None:
    """u = 3 - u(t - T)/2 was 2, the solution of its loop; or the loop begins with a given value."""

    def wiring(source: Any, total: Any, delay: Any, gain: Any) -> Connections:
        return (
            connect(source.y, total.u1),
            connect(total.y, delay.u),
            connect(delay.y, gain.u),
            connect(gain.y, total.u2),
        )

    for given, first in (({}, 2.0), ({"steady": False, "before": 1.0}, 2.5)):
        parts = (blocks.Constant(k=3.0), blocks.Sum(), blocks.FixedDelay(T=1.0, **given), blocks.Gain(k=-0.5))
        u = simulate(Rig(parts=parts, wiring=wiring), 2.0, save=[0.5, 1.5])["parts[1].y.value"]
        assert u == pytest.approx([first, 3.0 - 0.5 * first], abs=1e-12)


@pytest.mark.thorough
def test_delays_in_series_and_in_arrays() -> None:
    class Row(Component):
        source: blocks.Sine
        delays: Array[blocks.FixedDelay]
        last: blocks.FixedDelay

        def connections(self) -> Connections:
            return connect(self.source.y, self.delays[0].u, self.delays[1].u), connect(self.delays[1].y, self.last.u)

    delays = stack([blocks.FixedDelay(T=T) for T in (0.3, 0.4)])
    model = Row(source=blocks.Sine(amplitude=1.0, frequency=0.5), delays=delays, last=blocks.FixedDelay(T=0.5))
    solution = simulate(model, 2.0, rtol=1e-9, save=[1.7])
    assert solution["delays[0].y.value"] == pytest.approx(np.sin(np.pi * 1.4), abs=1e-8)
    assert solution["last.y.value"] == pytest.approx(np.sin(np.pi * 0.8), abs=1e-8)


def test_a_model_with_a_delay_says_what_it_cannot_do() -> None:
    with pytest.raises(SimulationError, match=r"parts\[2\]\.history: The history .* Increase the number n of steps"):
        simulate(delayed_loop(n=4), 5.0, rtol=1e-9)
    short = r"no step is longer than the delay of 0\.0001 s of parts\[2\]\.history, so 10 s take at least 100000 steps"
    with pytest.raises(SimulationError, match=short):
        simulate(delayed_loop(T=1e-4), 10.0, max_steps=50)
    with pytest.raises(ModelError, match=r"cannot go back in time, .* parts\[2\]\.history"):
        simulate(delayed_loop(), -1.0)
    with pytest.raises(ModelError, match=r"no exact delay: parts\[2\]\.history\. Remedy: a PadeDelay"):
        linearise(delayed_loop())
    with pytest.raises(ModelError, match=r"parts\[2\]\.history have no C form.*PadeDelay"):
        export_c(delayed_loop(), "unused", step=0.1)


class Keeper(Component, partial=True):
    """A component whose signal is the time, recorded for a while."""

    delay: Discrete[Scalar, "s"] = 0.0
    t: Time[Scalar, "s"] = 0.0
    since: Var[Scalar, "s"] = 0.0
    y: Var[Scalar, "s"] = 0.0
    past: Discrete[Vector, "", shape(8, ROW)] = -jnp.inf
    other: Discrete[Scalar, "s"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(since=eq(self.since, self.t - self.delay), y=eq(self.y, recall(self.past, self.since, 0.0)))


class Instantaneous(Keeper):
    def events(self) -> Events:
        return dict(kept=remember(self.delay, past=self.t))


class Mistaken(Keeper):
    def events(self) -> Events:
        return dict(kept=remember(1.0, other=self.t))


class Twice(Keeper):
    def events(self) -> Events:
        return dict(kept=remember(1.0, past=self.t, other=self.t))


def test_mistakes_in_components_that_remember() -> None:
    with pytest.raises(SimulationError, match=r"kept\.delay: the delay of a recorded signal must be positive"):
        simulate(Instantaneous(), 1.0)
    with pytest.raises(ModelError, match=r"kept records into other, which is not a history\. Declare it as"):
        simulate(Mistaken(), 1.0)
    with pytest.raises(ModelError, match=r"kept records 2 signals\. State one remember"):
        simulate(Twice(), 1.0)
