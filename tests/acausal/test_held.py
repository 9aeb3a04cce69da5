"""Laws in pieces whose event indicators come to rest at zero, or are zero for a while."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Discrete, Equations, Events, Param, Scalar, Var, at, eq, ifelse, simulate


class Bilinear(Component):
    """A mass on a damped spring that is stiffer beyond the place where it comes to rest."""

    place: Param[Scalar, "m"] = 1.0
    x: Var[Scalar, "m"] = 1.0
    v: Var[Scalar, "m/s"] = 0.0

    def equations(self, d: Self) -> Equations:
        reach = self.x - self.place
        pull = ifelse(reach > 0.0, 4e4, 1e4) * reach + 100.0 * self.v
        return dict(x=eq(d.x, self.v), v=eq(d.v, -pull, check_units=False))


@pytest.mark.thorough
@pytest.mark.parametrize("place", [0.1, 1.0, 3.0, 30.0])
def test_rest_at_a_bend_far_from_the_origin(place: float) -> None:
    """The margin is a difference of numbers that are as large as the place, and rounded as such. Where its sign
    counted, steps would be cut before a bend that does not come, and more than 20,000 would not end the run.
    """

    def steps(swing: float, rtol: float) -> Any:
        model = Bilinear(place=place, x=place + swing)
        return simulate(model, 10.0, save="end", rtol=rtol, nominal=dict(x=1e-3, v=1e-2)).stats["num_steps"]

    run = jax.jit(steps)
    for swing in (1e-6, 1e-4, 1e-2, -1e-2, 0.05, 0.3):
        for rtol in (1e-4, 1e-6, 1e-8):
            assert run(swing, rtol) < 1500


class Equalised(Component):
    """Two large numbers become equal, at a rate that differs by which is the larger one; both rise."""

    k: Param[Scalar, "1/s"] = 1.0
    rise: Param[Scalar, "1/s"] = 0.0
    a: Var[Scalar, "1"] = 3e7
    b: Var[Scalar, "1"] = 3e7

    def equations(self, d: Self) -> Equations:
        q = ifelse(self.a > self.b, 1.0, 3.0) * self.k * (self.a - self.b)
        return dict(a=eq(d.a, self.rise - q), b=eq(d.b, self.rise + q))


@pytest.mark.thorough
@pytest.mark.parametrize("k", [1.0, 1e3])
def test_what_is_equal_but_for_rounding_does_not_pass_to_and_fro_for_ever(k: float) -> None:
    """Both relations watch the same number: neither may keep a side that contradicts the other's."""

    def left(more: float, rise: float, rtol: float) -> Any:
        final = simulate(Equalised(k=k, a=3e7 + more, rise=rise), 100.0, save="end", rtol=rtol).final
        return jnp.abs(final.a - final.b)

    run = jax.jit(left)
    for more in (1e-3, 1.0, 1e3):
        for rise in (0.0, 1e4):
            for rtol in (1e-4, 1e-6, 1e-9):
                assert run(more, rise, rtol) < 1e-6


class Throttled(Component):
    """The same, where an equation that is solved for the flow has the law in pieces: where the flow is zero, it is
    found again by another piece, and differs by rounding.
    """

    rise: Param[Scalar, "1/s"] = 0.0
    a: Var[Scalar, "1"] = 3e7
    b: Var[Scalar, "1"] = 3e7
    q: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        law = ifelse(self.q > 0.0, 1.0, 3.0) * self.q
        rates = dict(a=(d.a, self.rise - 100.0 * self.q), b=(d.b, self.rise + 100.0 * self.q))
        rates |= dict(law=(law + 0.1 * jnp.sin(self.q), self.a - self.b))
        return {name: eq(left, right, check_units=False) for name, (left, right) in rates.items()}


@pytest.mark.thorough
@pytest.mark.parametrize("rise", [0.0, 1e4])
def test_a_margin_that_is_searched_for_does_not_pass_to_and_fro(rise: float) -> None:
    def left(more: float, rtol: float) -> Any:
        run = simulate(Throttled(rise=rise, a=3e7 + more), 100.0, save="end", rtol=rtol)
        return jnp.abs(run.final.a - run.final.b), run.stats["num_steps"]

    run = jax.jit(left)
    for more in (1e-3, 1.0, 1e3):
        for rtol in (1e-4, 1e-6, 1e-9):
            apart, steps = run(more, rtol)
            assert apart < 1e-6
            assert steps < 1000


def within(x: Scalar, low: float, high: float) -> Scalar:
    return ifelse(x < low, low, ifelse(x > high, high, x))


class Distance(Component):
    """The integral of how far a signal is from zero, on which it stays for a while."""

    kind: str = "clipped"
    t: Var[Scalar, "s"] = 0.0
    y: Var[Scalar, "1"] = 0.0

    def signal(self) -> Scalar:
        if self.kind == "clipped":
            return within(self.t - 1.0, 0.0, 1.0)
        return jnp.sin(self.t) - within(jnp.sin(self.t), -0.3, 0.3)

    def equations(self, d: Self) -> Equations:
        u = self.signal()
        return dict(t=eq(d.t, 1.0), y=eq(d.y, ifelse(u < 0.0, -u, u), check_units=False))


@pytest.mark.parametrize("rtol", [1e-3, 1e-4, 1e-6, 1e-9])
@pytest.mark.parametrize("kind", ["clipped", "dead zone"])
def test_a_bend_whose_margin_is_zero_for_a_while(kind: str, rtol: float) -> None:
    a = np.arcsin(0.3)
    exact = 2.5 if kind == "clipped" else _area(np.pi + a, 2.0 * np.pi - a) + _area(np.pi + a, 4.0)
    run = simulate(Distance(kind=kind), 4.0, save="end", rtol=rtol)
    np.testing.assert_allclose(run.final.y, exact, atol=30 * rtol)


def _area(a: float, b: float) -> float:
    """The area under -sin - 0.3 between two times."""
    return float(np.cos(b) - np.cos(a) - 0.3 * (b - a))


class Off(Component):
    """A slope that changes at a limit, which is far away until it is set; beside it an oscillation, for short steps."""

    s: Var[Scalar, "1"] = 0.0
    c: Var[Scalar, "1"] = 1.0
    u: Var[Scalar, "1"] = 0.0
    y: Var[Scalar, "s"] = 0.0
    limit: Discrete[Scalar, "1"] = 1e20

    def equations(self, d: Self) -> Equations:
        y = ifelse(self.u > self.limit, self.limit, self.u)
        rates = dict(u=(d.u, 1.0), y=(d.y, y), s=(d.s, 20.0 * self.c), c=(d.c, -20.0 * self.s))
        return {name: eq(left, right, check_units=False) for name, (left, right) in rates.items()}

    def events(self) -> Events:
        return dict(set=at(1.0, limit=2.0))


@pytest.mark.parametrize("off", [1e3, 1e8, 1e11, 1e12, 1e13, 1e20])
def test_a_limit_that_was_far_away_says_nothing_of_the_next_one(off: float) -> None:
    np.testing.assert_allclose(simulate(Off(limit=off), 4.0, save="end").final.y, 6.0, rtol=1e-9)
