"""The loop over the steps, and their sizes."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Equations, Events, Param, Scalar, Var, Vector, at, eq, simulate
from acausal._integrate.step import adjoint
from acausal._integrate.step.adjoint import nested_loop
from acausal._integrate.step.controller import PER_OCTAVE, on_grid


def squared(x: Scalar, n: Any, max_steps: int) -> Any:
    """x + x^2 + x^3 + ... by n rounds: sums and products that reverse mode has to go back through."""

    def body(carry: Any) -> Any:
        k, power, total = carry
        return k + 1, power * x, total + power * x

    start = (jnp.asarray(0), jnp.asarray(1.0), jnp.asarray(0.0))
    return nested_loop(lambda c: c[0] < n, body, start, max_steps=max_steps, buffers=lambda c: ())


@pytest.mark.parametrize("max_steps", [1, 10, 16, 17, 100, 300])
def test_loop_stops_by_its_condition_or_its_limit(max_steps: int) -> None:
    for n in (0, 1, 15, 16, 17, 40, 299, 1000):
        assert squared(0.5, n, max_steps)[0] == min(n, max_steps)


@pytest.mark.parametrize("held", [adjoint.HELD, -1])
def test_derivatives_of_the_loop(held: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """In both modes, with copies of the state kept on all levels or on the lowest one."""
    monkeypatch.setattr(adjoint, "HELD", held)
    x, n = 0.9, 270
    powers = np.arange(1, n + 1)
    expected = np.sum(powers * x ** (powers - 1.0))
    for mode in (jax.jacfwd, jax.grad):
        np.testing.assert_allclose(jax.jit(mode(lambda x: squared(x, n, 300)[2]))(x), expected, rtol=1e-12)


def test_step_sizes_lie_on_a_grid() -> None:
    sizes = np.geomspace(1e-12, 1e3, 101)
    got = np.array([float(on_grid(size)) for size in sizes])
    steps = PER_OCTAVE * np.log2(got)
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
    assert np.all(np.abs(np.log2(got / sizes)) <= 0.5 / PER_OCTAVE + 1e-9)
    # What differs by rounding comes out the same.
    assert np.all([float(on_grid(size * (1.0 + 1e-12))) for size in sizes] == got)


class Marked(Component):
    """A decay, with pairs of instants that lie close together."""

    times: Param[Vector, "s"]
    x: Var[Scalar, "1"] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(decay=eq(d.x, -self.x, check_units=False))

    def events(self) -> Events:
        return dict(mark=at(self.times))


def test_a_step_cut_short_by_an_instant_does_not_shorten_the_next_one() -> None:
    pairs = np.linspace(0.1, 2.0, 20)[:, None] + [0.0, 1e-7]
    solution = simulate(Marked(times=jnp.asarray(pairs.ravel())), 2.5, save="end", rtol=1e-6)
    assert solution.final.x == pytest.approx(np.exp(-2.5), rel=1e-5)
    assert solution.stats["num_steps"] < 2.5 * len(pairs)


class Robertson(Component):
    """A reaction whose times lie far apart (Robertson 1966)."""

    a: Var[Scalar, "1"] = 1.0
    b: Var[Scalar, "1"] = 0.0
    c: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        slow, back, fast = 0.04 * self.a, 1e4 * self.b * self.c, 3e7 * self.b**2
        rates = dict(a=(d.a, back - slow), b=(d.b, slow - back - fast), c=(d.c, fast))
        return {name: eq(left, right, check_units=False) for name, (left, right) in rates.items()}


@pytest.mark.thorough
def test_the_first_steps_of_a_long_run_may_be_short() -> None:
    """The smallest step is measured by the time since the start, not by the whole run."""
    end = simulate(Robertson(), 4e10, rtol=1e-8, nominal={"b": 1e-6}, save="end").final
    # The example of LSODE (Hindmarsh, ODEPACK) prints 5.2083e-8 at 4e10.
    np.testing.assert_allclose(end.a, 5.2083e-8, rtol=1e-4)
