"""Runs that go on from a point at which events have happened: each counts once."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np

from acausal import (
    Component,
    Discrete,
    Equations,
    Events,
    Param,
    Scalar,
    Var,
    at,
    eq,
    initialise,
    simulate,
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


def test_two_halves_make_a_whole() -> None:
    """Parted anywhere: between events, at a tick of the clock, and at a rebound but for rounding."""

    def parted(t: Any) -> Any:
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


def test_what_happens_in_the_search_for_a_start_happens_once() -> None:
    """It is listed where the start is searched for, and a run that resumes it goes on."""
    run = simulate(Counted(), 3.0, t0=2.0)
    np.testing.assert_allclose([run["x"][0], run.final.x, run.final.past, run.final.full], [4.0, 4.0, 1.0, 1.0])
    assert run.events.names == ["came", "fills"]
    np.testing.assert_allclose(run.events.times, 2.0)
    start = initialise(Counted(), t0=2.0)
    on = simulate(start, 3.0, t0=2.0, resume=True)
    np.testing.assert_allclose([on.final.x, on.final.past, on.final.full], [4.0, 1.0, 1.0])
    assert not on.events.names
