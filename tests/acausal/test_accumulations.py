"""Events that accumulate at a time end the run there, in any model; fast events that do not accumulate end nothing."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _switching_models import Rebound

from acausal import (
    Component,
    Discrete,
    Equations,
    Events,
    Param,
    Result,
    Scalar,
    SimulationError,
    Time,
    Var,
    at,
    eq,
    replace,
    simulate,
    when,
)
from acausal.design import sweep

G = 9.81


def limit(e: Any, height: float = 1.0) -> Any:
    """The time at which the impacts of a ball accumulate: each flight takes e times as long as the one before."""
    return np.sqrt(2.0 * height / G) * (1.0 + e) / (1.0 - e)


class Crowd(Component):
    """A ball beside events that have nothing to do with it."""

    ball: Rebound
    n: Discrete[Scalar, "1"] = 0.0
    t: Time[Scalar, "s"] = 0.0

    def events(self) -> Events:
        others = {f"later{i}": when(self.t > 1e3 + i, n=self.n + 1.0) for i in range(40)}
        phases = [jnp.sin((30.0 + i) * self.t) for i in range(3)]
        waves = {f"wave{i}": when(x > 0.0, check_units=False, n=self.n + 1.0) for i, x in enumerate(phases)}
        return dict(tick=at(0.0, every=0.01, n=self.n + 1.0), **others, **waves)


@pytest.mark.parametrize("floor", [0.0, 0.7])
@pytest.mark.parametrize("e", [0.9, 0.5, 0.1, 1e-4])
def test_a_rebound_that_dies_out_ends_on_the_floor(e: float, floor: float) -> None:
    solution = simulate(Rebound(e=e, floor=floor), 20.0, save="end", throw=False)
    assert solution.result == Result.events_accumulate
    assert float(solution._end[0]) == pytest.approx(limit(e, 1.0 - floor), abs=1e-4)
    assert solution.final.h == pytest.approx(floor, abs=1e-9)
    with pytest.raises(SimulationError, match=r"ever faster.*small speed.*The last events were impact"):
        simulate(Rebound(e=e, floor=floor), 20.0)


@pytest.mark.thorough
@pytest.mark.parametrize("t1", [0.75, 2.3, 1e4])
def test_neither_the_span_nor_other_events_matter(t1: float) -> None:
    ball = Rebound(e=0.5, floor=0.7)
    runs: list[tuple[Component, str]] = [(ball, "h"), (Crowd(ball=ball), "ball.h")]
    for model, height in runs:
        solution = simulate(model, t1, save="end", throw=False)
        assert solution.result == Result.events_accumulate
        assert float(solution._end[0]) == pytest.approx(limit(0.5, 0.3), abs=1e-5)
        assert solution[height][-1] == pytest.approx(0.7, abs=1e-9)


@pytest.mark.thorough
def test_a_rebound_that_dies_out_later_is_no_failure() -> None:
    """At the end of the run, 1e-3 of the duration before the limit, 10 impacts have happened."""
    solution = simulate(Rebound(e=0.5, floor=0.7), 0.999 * limit(0.5, 0.3), save="end")
    assert len(solution.events.times) == 10


@pytest.mark.thorough
def test_in_batches_and_sweeps() -> None:
    shares = np.array([0.3, 0.6, 0.95, 0.5])

    def run(model: Rebound) -> Any:
        return simulate(model, 2.3, save="end", throw=False)

    ball = Rebound(e=0.5)
    batch = jax.vmap(lambda e: run(replace(ball, {"e": e})))(shares)
    dies = limit(shares) < 2.3
    assert np.array_equal(np.asarray(batch.result == Result.events_accumulate), dies)
    assert np.array_equal(np.asarray(batch.result == Result.reached_end), ~dies)
    assert np.all(np.asarray(batch.final.h) > -1e-9)
    found = sweep(ball, {"e": shares}, {"height": (lambda s: s.final.h, "m")}, run=run)
    names = found["code"].attrs["flag_meanings"].split()
    assert [names[code] == "events_accumulate" for code in found["code"].values] == dies.tolist()
    assert np.array_equal(np.isnan(found["height"].values), dies)


class Pair(Component):
    one: Rebound
    other: Rebound


@pytest.mark.thorough
@pytest.mark.parametrize("others", [{"e": 0.6, "h": 2.0}, {"e": 0.999}, {"e": 0.5}])
def test_a_ball_beside_another_one(others: dict[str, float]) -> None:
    """The impacts of the other ball cut the flights that the run cannot resolve."""
    pair = Pair(one=Rebound(e=0.5, floor=0.7), other=Rebound(floor=0.7, **others))
    solution = simulate(pair, 6.0, save="end", throw=False)
    assert solution.result == Result.events_accumulate
    assert float(solution._end[0]) == pytest.approx(limit(0.5, 0.3), abs=1e-5)
    assert solution.final.one.h == pytest.approx(0.7, abs=1e-9)


class Tanks(Component):
    """Two tanks drain, and one inflow fills the one that has become empty (Johansson, Egerstedt, Lygeros, Sastry, `On
    the regularization of Zeno hybrid automata`, Systems and Control Letters 38, 1999).
    """

    inflow: Param[Scalar, "1"] = 1.5
    low: Param[Scalar, "1"] = 0.0
    a: Var[Scalar, "1"] = 1.0
    b: Var[Scalar, "1"] = 1.2
    fills_a: Discrete[Scalar, "1"] = 1.0

    def equations(self, d: Self) -> Equations:
        share = self.fills_a
        rates = dict(a=(d.a, self.inflow * share - 1.0), b=(d.b, self.inflow * (1.0 - share) - 1.0))
        return {name: eq(left, right, check_units=False) for name, (left, right) in rates.items()}

    def events(self) -> Events:
        return dict(a_low=when(self.a < self.low, fills_a=1.0), b_low=when(self.b < self.low, fills_a=0.0))


@pytest.mark.thorough
@pytest.mark.parametrize("low", [0.0, 0.3])
def test_two_events_that_alternate_ever_faster(low: float) -> None:
    """The sum of the levels falls by 2 less the inflow; both tanks are empty when it is twice the lowest level."""
    solution = simulate(Tanks(low=low), 6.0, save="end", throw=False)
    assert solution.result == Result.events_accumulate
    assert float(solution._end[0]) == pytest.approx((2.2 - 2.0 * low) / 0.5, abs=1e-9)
    assert np.array([solution.final.a, solution.final.b]) == pytest.approx(low, abs=1e-9)


class Burst(Component):
    """A switch with a narrow hysteresis, which rests after a number of events."""

    width: Param[Scalar, "1"]
    x: Var[Scalar, "1"] = 0.0
    u: Discrete[Scalar, "1"] = 1.0
    n: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(rate=eq(d.x, self.u, check_units=False))

    def events(self) -> Events:
        goes_on = jnp.where(self.n < 199.0, 1.0, 0.0)
        return dict(
            high=when(self.x > self.width, u=-goes_on, n=self.n + 1.0),
            low=when(self.x < -self.width, u=goes_on, n=self.n + 1.0),
        )


@pytest.mark.thorough
@pytest.mark.parametrize("width", [1e-3, 1e-6, 1e-9])
def test_a_burst_of_fast_events_ends(width: float) -> None:
    solution = simulate(Burst(width=width), 1e3, save="end")
    assert solution.final.n == 200.0
    assert solution.events.times[-1] == pytest.approx((2.0 * 200 - 1.0) * width, rel=1e-3)


class Counter(Component):
    """A signal that crosses its limit upwards at shrinking intervals, and then stays beyond it."""

    n: Discrete[Scalar, "1"] = 0.0
    t: Time[Scalar, "s"] = 0.0
    x: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(rate=eq(d.x, jnp.cos(self.t + 0.05 * self.t**2) + 0.03, check_units=False))

    def events(self) -> Events:
        return dict(above=when(self.x > 0.5, n=self.n + 1.0))


@pytest.mark.thorough
def test_a_condition_that_stays_true_at_last() -> None:
    solution = simulate(Counter(), 60.0, save="end")
    assert 2.0 < float(solution.final.n) < 15.0
    assert solution.final.x > 0.6


class Lifted(Component):
    """A body that falls ever more slowly and then rises, moved up to 1 when it reaches 0."""

    x: Var[Scalar, "1"] = 0.5
    v: Var[Scalar, "1"] = -1.2

    def equations(self, d: Self) -> Equations:
        return dict(speed=eq(d.x, self.v, check_units=False), force=eq(d.v, 1.0, check_units=False))

    def events(self) -> Events:
        return dict(lift=when(self.x < 0.0, x=1.0))


def test_an_event_that_moves_a_state_back_turns_nothing_back() -> None:
    """The first step after the event passes the turn and ends above 1."""
    assert simulate(Lifted(), 4.0, save="end").final.x == pytest.approx(1.5 - 1.2 * 4.0 + 8.0, abs=1e-9)


class Stops(Component):
    """A lock stops a rotor when its speed reaches zero; later it turns backwards."""

    t: Time[Scalar, "s"] = 0.0
    w: Var[Scalar, "1"] = 1.0
    free: Discrete[Scalar, "1"] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(rate=eq(d.w, -self.free, check_units=False))

    def events(self) -> Events:
        return dict(lock=when(self.w < 0.0, free=0.0), open=at(2.0, free=1.0))


def test_an_event_that_stops_a_motion_turns_nothing_back() -> None:
    assert simulate(Stops(), 3.0, save="end").final.w == pytest.approx(-1.0, abs=1e-9)
