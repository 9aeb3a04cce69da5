"""Samplers and sources that act at the same instants, against a discrete-event simulation in plain Python."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _sampled_train import Instants, N, drawn, held, train

from acausal import simulate

NEVER = 1000
# Everything at the start; then at random, some with zero within the run.
BEGINS = (0, 0, 0, -3, 4, -7, 0)
INTERVALS = np.array([0.1, 0.1, 0.037, 0.1, 0.1, 1.0 / 3.0, 0.7])
AT_START = Instants(0, (0, 1, 2), (0, 1), 0, [(0, 1), (0, 2), (0, 1)], 0)
LEVEL = 5e-4  # less than any jump of a source


def drawn_trains() -> list[Instants]:
    draw = np.random.default_rng(6)
    return [AT_START, *(drawn(draw, begin) for begin in BEGINS[1:])]


def without_events(instants: Instants) -> Instants:
    """With sources whose jumps are equations."""
    return instants._replace(step=NEVER, pulse=(NEVER, 1, 2))


def stacked(trains: list[Instants]) -> tuple[Any, ...]:
    numbers = jax.tree.map(lambda *leaves: np.array(leaves, float), *trains)
    return numbers, INTERVALS, np.array(BEGINS, float)


def expected(trains: list[Instants]) -> np.ndarray:
    return np.array([held(instants, begin) for instants, begin in zip(trains, BEGINS, strict=True)])


def outputs(s: Any) -> Any:
    return jnp.stack([s.first.y.value, s.second.y.value, s.third.y.value, s.control.y.value])


@jax.jit
@jax.vmap
def saved(instants: Instants, h: Any, begin: Any) -> Any:
    """The outputs in the middle between instants, and at all instants but the first, shapes [4, N] and [4, N - 1]."""
    save = h * (begin + jnp.arange(0.5, N, 0.5))
    sol = simulate(train(instants, h), h * (begin + N), t0=h * begin, save=save, rtol=1e-9, throw=False)
    return outputs(sol)[:, ::2], outputs(sol)[:, 1::2]


@pytest.mark.thorough
def test_samplers_read_what_holds_after_the_jumps_of_their_instant() -> None:
    trains = drawn_trains()
    np.testing.assert_allclose(saved(*stacked(trains))[0], expected(trains), atol=1e-7)


def test_samplers_read_jumps_of_equations() -> None:
    """And each other's old values: two in a row delay by one sample."""
    trains = [without_events(instants) for instants in drawn_trains()]
    np.testing.assert_allclose(saved(*stacked(trains))[0], expected(trains), atol=1e-7)


def test_what_is_saved_at_an_instant_is_what_held_before_it() -> None:
    middles, instants = saved(*stacked(drawn_trains()))
    np.testing.assert_allclose(instants, middles[:, :, :-1], atol=1e-7)


@jax.jit
@jax.vmap
def stopped(instants: Instants, h: Any, begin: Any) -> Any:
    """When the second sampler is first met by a jump, counted from the begin in intervals, and the outputs then."""
    until = lambda s: s.second.y.value - LEVEL  # noqa: E731
    sol = simulate(train(instants, h), h * (begin + N), t0=h * begin, until=until, save="end", rtol=1e-9, throw=False)
    return sol.t1 / h - begin, outputs(sol.final)


def stops(trains: list[Instants]) -> tuple[Any, Any]:
    """The same from the reference."""
    rows = expected(trains)
    ends = np.argmax(rows[:, 1] > LEVEL, axis=1)
    assert np.all(ends > 0)
    return ends, rows[np.arange(len(ends)), :, ends]


@pytest.mark.thorough
def test_a_run_that_a_sample_stops_ends_after_all_samples_of_its_instant() -> None:
    trains = [without_events(instants) for instants in drawn_trains()]
    for found, wanted in zip(stopped(*stacked(trains)), stops(trains), strict=True):
        np.testing.assert_allclose(found, wanted, atol=1e-7)


@pytest.mark.thorough
def test_a_run_is_stopped_by_a_sample_of_a_jump_of_its_instant() -> None:
    trains = drawn_trains()
    for found, wanted in zip(stopped(*stacked(trains)), stops(trains), strict=True):
        np.testing.assert_allclose(found, wanted, atol=1e-7)
