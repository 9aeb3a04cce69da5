"""Discrete variables that follow values in the event iteration, and events at the start of a run."""

from pathlib import Path
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _following import Chain, Counters, Floor, Followed, Friction, Rack, Start, Written

from acausal import Component, Discrete, Equations, Events, ModelError, Scalar, Var, eq, initialise, simulate, stack
from acausal._declare.component import follow
from acausal.codegen import export_c
from components import blocks, translational


def test_chain_in_one_instant() -> None:
    """The modes advance in three rounds, at their instant, and no value is taken over while a relation is out of date.
    At the start, the value is that of the first equations, 5 s.
    """
    run = simulate(Chain(), 1.0, save=[0.4, 0.6])
    np.testing.assert_array_equal([run.a, run.b, run.c], [[0.0, 1.0], [0.0, 2.0], [0.0, 3.0]])
    np.testing.assert_array_equal([run.rounds, run.late, run.last_c], [[0.0, 3.0], [0.0, 0.0], [0.0, 3.0]])
    np.testing.assert_array_equal([run.first, run.initial], [[5.0, 5.0], [0.0, 0.0]])
    assert not len(run.events.times)


@pytest.mark.thorough
def test_a_continued_run_does_not_start() -> None:
    first = simulate(Chain(), 0.3)
    model = first.final
    last = simulate(model, 1.0, t0=0.3, resume=True).final
    np.testing.assert_array_equal([last.a, last.b, last.c, last.rounds], [1.0, 2.0, 3.0, 3.0])
    np.testing.assert_array_equal([last.initial, last.first], [0.0, 5.0])


@pytest.mark.thorough
def test_friction_in_the_words_of_modelica() -> None:
    """The times of sticking and sliding are those of the friction component; the first break-away is where the force
    is Fs.
    """
    runs = [
        simulate(
            Floor(
                mass=translational.Mass(m=1.0, s=0.0, v=0.0),
                friction=friction(Fc=8.0, Fs=10.0, vs=0.1),
                push=translational.SignalForce(),
                force=blocks.Sine(amplitude=12.0, frequency=0.5),
            ),
            5.0,
            rtol=1e-9,
        )
        for friction in (translational.StribeckFriction, Friction)
    ]
    ours, followed = (np.asarray(run.events.times) for run in runs)
    assert len(followed) == 10
    np.testing.assert_allclose(followed, ours, atol=1e-6)
    np.testing.assert_allclose(followed[1], np.arcsin(10.0 / 12.0) / np.pi, atol=1e-9)
    np.testing.assert_allclose(runs[1].final.mass.s, runs[0].final.mass.s, atol=1e-6)


def reached(plant: Any, kp: Any) -> Any:
    return simulate(plant(kp=kp, ki=3.0), 1.05, rtol=1e-10, save="end").final.x


def test_sampled_controller() -> None:
    """Stated by equations and by the event itself: the same values, for a batch of gains."""
    gains = jnp.array([0.5, 2.0])
    ours, followed = (jax.vmap(lambda kp, plant=plant: reached(plant, kp))(gains) for plant in (Written, Followed))
    np.testing.assert_allclose(followed, ours, rtol=1e-10)


@pytest.mark.thorough
def test_derivatives_of_a_sampled_controller() -> None:
    def end(kp: Any) -> Any:
        return reached(Followed, kp)

    h = 1e-4
    difference = (end(2.0 + h) - end(2.0 - h)) / (2.0 * h)
    for derivative in (jax.jacfwd, jax.grad):
        np.testing.assert_allclose(derivative(end)(2.0), difference, rtol=1e-6)


@pytest.mark.thorough
def test_derivative_by_the_time_of_a_tick() -> None:
    """Against the controller that the event states itself."""

    def end(plant: Any, period: Any) -> Any:
        return simulate(plant(kp=2.0, ki=3.0, period=period), 1.05, rtol=1e-10, save="end").final.x

    ours, followed = (jax.grad(lambda period, plant=plant: end(plant, period))(0.1) for plant in (Written, Followed))
    np.testing.assert_allclose(followed, ours, rtol=1e-8)


@pytest.mark.thorough
def test_members_and_elements() -> None:
    """Members of an array start at their own times, elements advance to their own limits, and NaN is not followed."""
    first = Counters(since=0.2, limits=jnp.array([1.0, 3.0]))
    second = Counters(since=0.7, limits=jnp.array([2.0, 30.0]))
    parts = simulate(Rack(parts=stack([first, second])), 1.0, save=[0.1, 0.5, 1.0]).parts
    np.testing.assert_array_equal(parts[0].last, [[0.0, 0.0], [1.0, 3.0], [1.0, 3.0]])
    np.testing.assert_array_equal(parts[1].last, [[0.0, 0.0], [0.0, 0.0], [2.0, 30.0]])
    np.testing.assert_array_equal(parts.item.n, parts.item.last)
    np.testing.assert_array_equal(parts.item.bad, 0.0)


def test_start_values_precede_the_start() -> None:
    """Initial equations see `initial` as 1, the run sees it as 0; a model from `initialise` starts once."""
    for model in (Start(), initialise(Start())):
        run = simulate(model, 1.0)
        np.testing.assert_allclose(np.array([run.x[0], run.final.x]), [3.0, 4.0], rtol=1e-12)
        np.testing.assert_array_equal([run.final.initial, run.final.starts], [0.0, 1.0])


class Slope(Component, partial=True):
    x: Var[Scalar, ""] = 0.0
    y: Discrete[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(rate=eq(d.x, 1.0))


class Wrong(Slope):
    """A variable follows, but only a discrete one can."""

    def events(self) -> Events:
        return dict(_last=follow(x=self.y))


class Nothing(Slope):
    def events(self) -> Events:
        return dict(_last=follow())


def test_errors(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"_last changes x, a var. Declare it with Discrete"):
        simulate(Wrong(), 1.0)
    with pytest.raises(ModelError, match=r"_last changes nothing"):
        simulate(Nothing(), 1.0)
    with pytest.raises(ModelError, match=r"_last, _start, _count have no C form"):
        export_c(Chain(), tmp_path, step=1e-3)
