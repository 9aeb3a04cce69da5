"""Runs that go on from a point at which events have happened: each counts once."""

import copy
import pickle
from typing import Any, Self

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import (
    Component,
    Discrete,
    Equations,
    Events,
    ModelError,
    Param,
    Result,
    Scalar,
    Var,
    at,
    eq,
    initialise,
    linearise,
    repeat,
    replace,
    simulate,
    stack,
    when,
)

G, E = 9.81, 0.8
FALL = (2.0 / G) ** 0.5


class Ball(Component):
    """A ball that rebounds with a share E of its speed, beside a clock; both are counted."""

    period: Param[Scalar, "s"] = 0.25
    h: Var[Scalar, "m"] = 1.0
    v: Var[Scalar, "m/s"] = 0.0
    rebounds: Discrete[Scalar, "1"] = 0.0
    ticks: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(speed=eq(d.h, self.v), fall=eq(d.v, -G, check_units=False))

    def events(self) -> Events:
        return dict(
            rebound=when(self.h < 0.0, v=-E * self.v, rebounds=self.rebounds + 1.0),
            tick=at(self.period, every=self.period, ticks=self.ticks + 1.0),
        )


@pytest.mark.thorough
def test_two_halves_make_a_whole() -> None:
    """Parted anywhere: between events, at a tick of the clock, and at a rebound but for rounding."""

    def parted(t: Scalar) -> Scalar:
        first = simulate(Ball(), t, rtol=1e-10, save="end")
        last = simulate(first.final, 2.0, t0=t, rtol=1e-10, save="end", resume=True).final
        return jnp.stack([last.h, last.v, last.rebounds, last.ticks])

    times = np.array([0.1, 0.25, 0.5, FALL - 1e-12, FALL, FALL + 1e-13, 1.3, (1.0 + 2.0 * E) * FALL])
    since, v = 2.0 - (1.0 + 2.0 * E + 2.0 * E**2) * FALL, E**3 * G * FALL
    whole = [v * since - G * since**2 / 2.0, v - G * since, 3.0, 7.0]
    np.testing.assert_allclose(jax.jit(jax.vmap(parted))(times), np.tile(whole, (len(times), 1)), atol=1e-8)


class Counted(Component):
    """A store at rest at the start. What lies before the start is counted, and that it is more than half full there."""

    x: Var[Scalar, "1"] = 0.0
    past: Discrete[Scalar, "1"] = 0.0
    full: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(store=eq(d.x, 3.0 + self.past - self.x, check_units=False))

    def initial_equations(self, d: Self) -> Equations:
        return dict(rest=eq(d.x))

    def events(self) -> Events:
        return dict(came=at(1.0, past=self.past + 1.0), fills=when(self.x > 0.5, full=self.full + 1.0))


@pytest.mark.thorough
def test_what_happens_in_the_search_for_a_start_happens_once() -> None:
    """It is listed where the start is searched for, and a run that resumes it goes on."""
    run = simulate(Counted(), 3.0, t0=2.0)
    np.testing.assert_allclose(
        np.array([run["x"][0], run.final.x, run.final.past, run.final.full]), [4.0, 4.0, 1.0, 1.0]
    )
    assert run.events.names == ["came", "fills"]
    np.testing.assert_allclose(run.events.times, 2.0)
    start = initialise(Counted(), t0=2.0)
    on = simulate(start, 3.0, t0=2.0, resume=True)
    np.testing.assert_allclose(np.array([on.final.x, on.final.past, on.final.full]), [4.0, 1.0, 1.0])
    assert not on.events.names


class Counter(Component):
    """A store that is fed, with a clock and an event at a time; what the inflow exceeds is counted, too."""

    u: Param[Scalar, "1"] = 3.0
    x: Var[Scalar, "1"] = 0.0
    past: Discrete[Scalar, "1"] = 0.0
    ticks: Discrete[Scalar, "1"] = 0.0
    full: Discrete[Scalar, "1"] = 0.0
    large: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(store=eq(d.x, self.u + self.past - self.x, check_units=False))

    def events(self) -> Events:
        return dict(
            came=at(1.0, past=self.past + 1.0),
            tick=at(0.5, every=0.5, ticks=self.ticks + 1.0),
            fills=when(self.x > 0.5, full=self.full + 1.0),
            grows=when(self.u > 4.0, large=self.large + 1.0),
        )


def counts(start: Counter, t1: float, **options: Any) -> list[float]:
    """The counts at the end, after a start at rest."""
    run = simulate(start, t1, rtol=1e-9, **options)
    np.testing.assert_allclose(run["x"][0], 4.0)
    return [float(n) for n in (run.final.past, run.final.ticks, run.final.full, run.final.large)]


@pytest.mark.thorough
def test_a_start_knows_what_has_happened() -> None:
    """At its time nothing happens twice; later what became due since, and what a changed parameter makes true."""
    start = initialise(Counter(), steady=True, t0=2.0)
    for again in (start, initialise(start, steady=True, t0=2.0), pickle.loads(pickle.dumps(copy.deepcopy(start)))):
        assert counts(again, 2.4, t0=2.0) == [1.0, 1.0, 1.0, 0.0]
    assert counts(start, 3.1, t0=3.0) == [1.0, 2.0, 1.0, 0.0]
    assert counts(start, 2.4, t0=2.0, resume=False) == [2.0, 2.0, 2.0, 0.0]
    changed = [replace(start, {"u": 5.0}), eqx.tree_at(lambda model: model.u, start, 5.0)]
    assert [counts(model, 2.4, t0=2.0) for model in changed] == 2 * [[1.0, 1.0, 1.0, 1.0]]
    np.testing.assert_allclose(linearise(start, t=2.0).A, -1.0)
    assert len(stack([start, Counter()])) == len(repeat(start, 2)) == 2


@pytest.mark.thorough
def test_a_start_is_not_begun_before_its_time() -> None:
    """Events until then would happen again: an error, or a result where the numbers are not known."""
    start = initialise(Counter(), steady=True, t0=2.0)
    with pytest.raises(ModelError, match=r"The start values belong to a later time.* got t0=0\."):
        simulate(start, 2.4)
    run = eqx.filter_jit(lambda model, t0: simulate(model, 2.4, t0=t0, save="end", throw=False))
    early, late = run(start, jnp.asarray(0.0)), run(start, jnp.asarray(2.0))
    assert early.result == Result.bad_option
    np.testing.assert_allclose([late.final.past, late.final.ticks, late.final.full], 1.0)
    for again in (lambda t: initialise(start, t0=t).x, lambda t: linearise(start, t=t).rates[0]):
        with pytest.raises(ModelError, match=r"The start values belong to a later time.* got t0?=1\."):
            again(1.0)
        assert jnp.isnan(jax.jit(again)(jnp.asarray(1.0)))


def test_a_start_is_a_point_to_linearise_at() -> None:
    """The event history of a model is none of its values."""
    start = initialise(Counter(), steady=True, t0=2.0)
    system = linearise(start, at=start, inputs=["u"])
    np.testing.assert_allclose([*system.A[0], *system.B[0], *system.rates], [-1.0, 1.0, 0.0], atol=1e-9)


class Struck(Component):
    """A ball on its way into the floor: an event that sets a state counts, too."""

    h: Var[Scalar, "m"] = -0.1
    v: Var[Scalar, "m/s"] = -1.0
    hits: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(speed=eq(d.h, self.v), fall=eq(d.v, -G, check_units=False))

    def initial_equations(self, d: Self) -> Equations:
        return dict(fast=eq(self.v, -1.0, check_units=False))

    def events(self) -> Events:
        return dict(hit=when((self.h < 0.0) & (self.v < 0.0), v=-E * self.v, hits=self.hits + 1.0))


class Kicked(Component):
    """A body that coasts and is set to a speed at 1 s."""

    x: Var[Scalar, "m"] = 0.0
    v: Var[Scalar, "m/s"] = 0.0
    kicks: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(speed=eq(d.x, self.v), coasts=eq(d.v))

    def events(self) -> Events:
        return dict(kick=at(1.0, v=5.0, kicks=self.kicks + 1.0))


@pytest.mark.thorough
def test_a_search_begins_with_the_states_that_past_events_have_set() -> None:
    """As a run does; what conditions say of these states counts all the same."""
    held = initialise(Kicked(), lambda s, d: dict(slow=eq(s.v, 2.0, check_units=False)), t0=2.0)
    for model, v in ((Kicked(), 5.0), (initialise(Kicked(v=1.0), t0=2.0), 5.0), (held, 2.0)):
        run = simulate(model, 3.0, t0=2.0)
        np.testing.assert_allclose(np.array([run["v"][0], run.final.x, run.final.kicks]), [v, v, 1.0], rtol=1e-6)


@pytest.mark.thorough
def test_what_sets_states_too_happens_once() -> None:
    """A search sets the discrete variables; the run that begins there, the states."""
    start = initialise(Struck())
    for model in (Struck(), start, initialise(start)):
        run = simulate(model, 0.05)
        np.testing.assert_allclose(np.array([run["v"][0], run["hits"][0], run.final.hits]), [E, 1.0, 1.0])
        assert run.events.names == ["hit"]
    np.testing.assert_allclose(np.array([start.v, start.hits]), [-1.0, 1.0])


@pytest.mark.slow
def test_starts_of_a_batch_know_what_has_happened() -> None:
    """With derivatives of what follows: x = u + past at rest."""

    def end(u: Scalar) -> Scalar:
        final = simulate(initialise(Counter(u=u), steady=True, t0=2.0), 2.4, t0=2.0, save="end").final
        return jnp.stack([final.x, final.past, final.ticks, final.full])

    values, slopes = jax.vmap(lambda u: jax.jvp(end, (u,), (1.0,)))(jnp.array([1.0, 2.0]))
    np.testing.assert_allclose(values, [[2.0, 1.0, 1.0, 1.0], [3.0, 1.0, 1.0, 1.0]], atol=1e-6)
    np.testing.assert_allclose(slopes, [[1.0, 0.0, 0.0, 0.0]] * 2, atol=1e-6)


class Ticker(Component):
    """A clock from the start on, and the time that has passed since 0."""

    x: Var[Scalar, "s"] = 0.0
    ticks: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(passing=eq(d.x, 1.0))

    def events(self) -> Events:
        return dict(tick=at(0.0, every=0.25, ticks=self.ticks + 1.0))


UNTIL = {
    "start": lambda s: s.x,
    "tick at the start": lambda s: s.ticks - 0.5,
    "instant of a tick": lambda s: s.x - 0.25,
    "tick": lambda s: s.ticks - 2.5,
    "between ticks": lambda s: s.x - 0.3,
}


@pytest.mark.parametrize("until", UNTIL.values(), ids=UNTIL)
def test_what_happened_at_a_stop_does_not_happen_again(until: Any) -> None:
    first = simulate(Ticker(), 2.1, until=until, save="end")
    assert first.result == Result.stopped
    assert simulate(first.final, 2.1, t0=first.t1, resume=True, save="end").final.ticks == 9.0
