"""Programs that are compiled quickly at first, and with optimisations once they have taken many steps."""

import contextlib
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

import jax
import numpy as np
import pytest
from _models import gear_train, rc
from test_events import Ball

from acausal import Component, Equations, Param, Scalar, Var, eq, replace, simulate
from acausal._integrate.programs import stored_program
from acausal._integrate.programs.stored_program import OPTIMISED, QUICK
from acausal._jax_settings import programs


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, int | None]]:
    """The names and levels of the programs compiled in stages, in a process without a cache."""
    found: list[tuple[str, int | None]] = []
    whole = stored_program._compiled

    def noted(file: Any, function: Any, structure: Any, kinds: Any, level: int | None) -> Any:
        found.append((function.name, level))
        return whole(file, function, structure, kinds, level)

    stored_program._program.cache_clear()
    monkeypatch.setattr(stored_program, "_compiled", noted)
    monkeypatch.setattr(stored_program, "_is_usual", lambda: True)  # the tests switch optimisations off themselves
    monkeypatch.setattr(programs, "in_stages", True)
    return found


MODELS: dict[str, Callable[[], Component]] = {
    "circuit": rc,
    "gears": lambda: gear_train(3.0),
    "impacts": lambda: Ball(h=1.0, e=0.7),
}


@pytest.mark.thorough
@pytest.mark.parametrize("name", MODELS)
def test_both_stages_and_a_traced_run_agree(
    name: str, compiled: list[tuple[str, int | None]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stored_program, "REPAYS", 300)  # one call of the steps of a small model is 256
    model = MODELS[name]()

    def end(model: Component) -> np.ndarray:
        return np.asarray(simulate(model, 1.0, save="end", rtol=1e-8)._end[1])

    quick = end(model)
    assert {level for _, level in compiled} == {QUICK}
    optimised = end(model)
    assert ("steps", OPTIMISED) in compiled
    traced = np.asarray(jax.jit(lambda model: simulate(model, 1.0, save="end", rtol=1e-8)._end[1])(model))
    np.testing.assert_allclose(quick, optimised, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(traced, optimised, rtol=1e-12, atol=1e-14)


def test_a_program_is_optimised_once_its_steps_repay_it(
    compiled: list[tuple[str, int | None]], monkeypatch: pytest.MonkeyPatch
) -> None:
    steps = 256  # in a call, for a model as small as this
    monkeypatch.setattr(stored_program, "REPAYS", 3 * steps)
    levels = []
    for i in range(5):
        simulate(replace(rc(), {"r.R": 1.0 + i}), 1.0)
        levels.append([level for program, level in compiled if program == "steps"])
    assert levels == [[QUICK], [QUICK], [QUICK, OPTIMISED], [QUICK, OPTIMISED], [QUICK, OPTIMISED]]


@pytest.mark.thorough
@pytest.mark.parametrize("error", [KeyboardInterrupt, MemoryError])
def test_an_optimisation_that_ends_early_is_tried_again_after_an_interrupt_and_costs_no_run(
    error: type[BaseException], compiled: list[tuple[str, int | None]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stored_program, "REPAYS", 300)
    noted, errors = stored_program._compiled, [error()]

    def failing(*arguments: Any) -> Any:
        if arguments[-1] == OPTIMISED and errors:
            raise errors.pop()
        return noted(*arguments)

    monkeypatch.setattr(stored_program, "_compiled", failing)
    quick = simulate(rc(), 1.0, save="end")._end[1]
    with pytest.raises(error) if error is KeyboardInterrupt else contextlib.nullcontext():
        np.testing.assert_array_equal(simulate(rc(), 1.0, save="end")._end[1], quick)
    assert not errors
    np.testing.assert_allclose(simulate(rc(), 1.0, save="end")._end[1], quick, rtol=1e-12)
    assert (("steps", OPTIMISED) in compiled) == (error is KeyboardInterrupt)


def new_lag() -> Component:
    """A lag from rest, of a class whose programs no process has compiled before. Those that jax has stored cannot be
    stored again.
    """
    rate = random.random()

    class Lag(Component):
        k: Param[Scalar, ""] = 2.0
        x: Var[Scalar, ""] = 0.0

        def equations(self, d: Self) -> Equations:
            return dict(lag=eq(d.x, rate * (self.k - self.x)))

        def initial_equations(self, d: Self) -> Equations:
            return dict(rest=eq(d.x))

    return Lag()


def test_an_optimised_program_on_disk_needs_no_quick_one(
    compiled: list[tuple[str, int | None]], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    model = new_lag()
    monkeypatch.setattr(programs, "folder", tmp_path)
    monkeypatch.setattr(stored_program, "REPAYS", 1)
    simulate(model, 1.0)
    assert sorted("quick" in file.stem for file in tmp_path.glob("steps-*-program")) == [False, True]
    stored_program._program.cache_clear()
    compiled.clear()
    simulate(model, 1.0)
    assert not compiled


def test_a_search_for_a_start_and_the_run_from_there_are_stored(
    compiled: list[tuple[str, int | None]], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    model = new_lag()
    monkeypatch.setattr(programs, "folder", tmp_path)
    simulate(model, 1.0)
    assert {program for program, _ in compiled} >= {"search", "start", "steps", "end"}
    stored_program._program.cache_clear()
    compiled.clear()
    simulate(model, 1.0)
    assert not compiled
