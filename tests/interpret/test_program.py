"""Programs interpreted at first and compiled in parts: the same results wherever they are compiled, if at all."""

import contextlib
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _runs import RUNS, charged, tabulated_spring
from jax import lax

from acausal import Component, Equations, Scalar, SimulationError, Solution, Time, Var, eq, simulate
from acausal._integrate.programs import stored_program
from acausal._interpret import in_parts, program
from acausal._interpret.program import OPTIMISED, OPTIONS, QUICK, Compiler, NumbersProgram
from acausal._interpret.simplify import simplified
from acausal._jax_private import options
from acausal._jax_settings import choose_optimisation, programs

pytestmark = pytest.mark.interpreted

NEVER = 10**9
Made = list[tuple[str, str]]  # parts with their levels


def collatz(n: Any) -> Any:
    """Steps of Collatz's sequence to 1 and the largest number on the way, then the same from there."""

    def step(state: Any) -> Any:
        n, steps, most = state
        return jnp.where(n % 2 == 0, n // 2, 3 * n + 1), steps + 1, jnp.maximum(most, n)

    _, steps, most = lax.while_loop(lambda state: state[0] != 1, step, (n, 0, n))
    return steps, most, lax.while_loop(lambda state: state[0] != 1, step, (most, 0, most))[1]


FOUND = {27: (111, 9232, 34), 97: (118, 9232, 34), 1: (0, 1, 0), 7: (16, 52, 11)}


class Store(Compiler):
    """Parts compiled in this process, and errors to raise in place of compiling."""

    def __init__(self, *errors: BaseException) -> None:
        super().__init__("function")
        self.made: Made = []
        self.kept: dict[tuple[str, str], Any] = {}
        self.errors = list(errors)

    def stored(self, part: str, level: str, n_inputs: int) -> Any:
        return self.kept.get((part, level))

    def compiled(self, part: str, level: str, run: Callable[..., Any], shapes: Any) -> Any:
        self.made.append((part, level))
        if self.errors:
            raise self.errors.pop()
        return jax.jit(lambda *values: run(*values)).lower(*shapes).compile(OPTIONS[level])


def new_program(store: Store, *, steps: int = 1, at_once: bool = False) -> Callable[[int], tuple[int, ...]]:
    made = NumbersProgram(simplified(jax.make_jaxpr(collatz)(1)), store, steps, at_once=at_once)
    return lambda n: tuple(map(int, made([np.int64(n)])))


@pytest.mark.parametrize("pays", [0, 1, 2, 10, 50, 100, NEVER])
def test_a_loop_goes_on_where_it_is(pays: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Inputs are different from call to call, so that the switch happens anywhere, also between calls."""
    monkeypatch.setattr(program, "PAYS", pays)
    store = Store()
    run = new_program(store)
    for n in (1, 7, 27, 97, 27, 7, 1):
        assert run(n) == FOUND[n]
    assert (store.made == []) == (pays == NEVER)
    assert len(set(store.made)) == len(store.made)


def test_what_is_called_often_is_compiled_as_a_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    store = Store()
    made = NumbersProgram(simplified(jax.make_jaxpr(lambda x: jnp.sin(x) * 2.0 + jnp.cos(x))(1.0)), store, 1)
    for i in range(program.PAYS + 3):
        x = 0.1 * i
        np.testing.assert_allclose(made([x]), [np.sin(x) * 2.0 + np.cos(x)], rtol=1e-14)
        assert store.made == ([] if i < program.PAYS else [("whole", QUICK)])


def test_a_program_compiled_at_once() -> None:
    store = Store()
    run = new_program(store, at_once=True)
    assert store.made == [("whole", OPTIMISED)]
    assert [run(n) for n in FOUND] == list(FOUND.values())
    assert store.made == [("whole", OPTIMISED)]


def test_a_part_is_optimised_once_its_steps_repay_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(program, "PAYS", 0)
    monkeypatch.setattr(program, "REPAYS", 1000)
    store = Store()
    run = new_program(store, steps=400)
    levels = []
    for _ in range(5):
        assert run(27) == FOUND[27]
        levels.append([level for _, level in store.made])
    assert levels == [[QUICK], [QUICK], *[[QUICK, OPTIMISED]] * 3]
    store.made.clear()
    run = new_program(store)
    assert run(27) == FOUND[27]
    assert store.made == [("whole", QUICK)]


def test_stored_parts_are_not_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Even before they would pay; a quick one is optimised after as many steps as one compiled here."""
    monkeypatch.setattr(program, "REPAYS", 2)
    store = Store()
    first = new_program(store, at_once=True)
    assert first(27) == FOUND[27]

    def call(*values: Any) -> Any:
        used.append(1)
        return collatz(*values)

    used: list[int] = []
    for level, then in ((OPTIMISED, []), (QUICK, [("whole", OPTIMISED)])):
        used.clear()
        store.kept, store.made = {("whole", level): call}, []
        run = new_program(store)
        assert run(7) == FOUND[7]
        assert (len(used), store.made) == (1, [])
        for _ in range(3):
            assert run(27) == FOUND[27]
        assert store.made == then


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt, MemoryError])
def test_a_compilation_that_fails_is_tried_again(error: type[BaseException], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(program, "PAYS", 20)
    store = Store(error("not compiled"))
    run = new_program(store)
    with pytest.raises(error, match="not compiled"):
        run(27)
    assert len(store.made) == 1
    assert run(27) == FOUND[27]
    assert run(97) == FOUND[97]
    assert store.made[0] == store.made[1]
    assert len(set(store.made)) == len(store.made) - 1


@pytest.mark.parametrize("error", [MemoryError, KeyboardInterrupt])
def test_an_optimisation_that_fails_costs_no_run_and_an_interrupted_one_is_tried_again(
    error: type[BaseException], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(program, "PAYS", 0)
    monkeypatch.setattr(program, "REPAYS", 10)
    store = Store()
    run = new_program(store, steps=6)
    assert run(27) == FOUND[27]
    store.errors = [error()]
    is_interrupt = error is KeyboardInterrupt
    with pytest.raises(error) if is_interrupt else contextlib.nullcontext():
        assert run(27) == FOUND[27]
    assert not store.errors
    for _ in range(3):
        assert run(27) == FOUND[27]
    assert [level for _, level in store.made] == [QUICK, *[OPTIMISED] * (1 + is_interrupt)]


def test_threads_share_what_is_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(program, "PAYS", 20)
    store, gate = Store(), threading.Barrier(4)
    run = new_program(store)

    def all_numbers(_: int) -> list[Any]:
        gate.wait()
        return [run(n) for _ in range(5) for n in FOUND]

    with ThreadPoolExecutor(4) as pool:
        for found in pool.map(all_numbers, range(4)):
            assert found == [*FOUND.values()] * 5
    assert store.made
    assert len(set(store.made)) == len(store.made)


# ---------------------------------------------------------------------------------------------------------------------
# Runs of models
# ---------------------------------------------------------------------------------------------------------------------


@pytest.fixture
def compiled(without_jax_cache: None, monkeypatch: pytest.MonkeyPatch) -> Made:
    """The parts compiled for runs, in a process without a cache: what jax has loaded from its own is not stored."""
    made: Made = []
    whole = stored_program._Store.compiled

    def noted(store: Any, part: str, level: str, *others: Any) -> Any:
        made.append((f"{store.name} {part}", level))
        return whole(store, part, level, *others)

    stored_program._program.cache_clear()
    monkeypatch.setattr(stored_program._Store, "compiled", noted)
    return made


def run_anew(run: Callable[[], Solution[Any]]) -> Solution[Any]:
    stored_program._program.cache_clear()
    return run()


def assert_agree(found: Solution[Any], expected: Solution[Any]) -> None:
    """All that a solution holds, up to roundings. Errors of steps are differences of almost equal numbers."""
    assert jax.tree.structure(found) == jax.tree.structure(expected)
    for (path, a), b in zip(jax.tree_util.tree_leaves_with_path(found), jax.tree.leaves(expected), strict=True):
        name = jax.tree_util.keystr(path)
        assert np.asarray(a).dtype == np.asarray(b).dtype, name
        if np.asarray(b).dtype.kind != "f":
            np.testing.assert_array_equal(a, b, err_msg=name)
            continue
        size = np.max(np.abs(b), initial=0.0, where=np.isfinite(b))
        near = 1e-6 if "_errors" in name else 1e-10 * size + 1e-14 if "coeffs" in name else 1e-12 * size
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=near, err_msg=name)


@pytest.mark.parametrize(
    "name", [name if name == "circuit" else pytest.param(name, marks=pytest.mark.thorough) for name in RUNS]
)
def test_all_ways_to_run_a_model_agree(
    name: str, compiled: Made, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    run = RUNS[name]
    with monkeypatch.context() as patch:
        patch.setattr(program, "PAYS", NEVER)
        interpreted = run_anew(run)
        assert not compiled
    with monkeypatch.context() as patch:
        patch.setattr(in_parts, "is_usual", lambda: False)
        assert_agree(interpreted, run_anew(run))  # with the traced functions
        assert not compiled
    monkeypatch.setattr(programs, "folder", tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr(program, "PAYS", 2)
        assert_agree(run_anew(run), interpreted)
        assert "steps loop0" in [part for part, _ in compiled]  # in the middle
        assert {level for _, level in compiled} == {QUICK}
    compiled.clear()
    assert_agree(run_anew(run), interpreted)
    assert "steps loop0" not in [part for part, _ in compiled]  # was stored
    with monkeypatch.context() as patch:
        patch.setattr(programs, "in_parts", False)
        assert_agree(run_anew(run), interpreted)
        assert ("steps whole", OPTIMISED) in compiled


def test_results_do_not_depend_on_where_the_switch_happens(compiled: Made, monkeypatch: pytest.MonkeyPatch) -> None:
    kept: dict[tuple[str, str], Any] = {}
    whole = stored_program._Store.compiled

    def once(store: Any, part: str, level: str, *others: Any) -> Any:
        key = store.name + part, level
        if key not in kept:
            kept[key] = whole(store, part, level, *others)
        return kept[key]

    monkeypatch.setattr(stored_program._Store, "compiled", once)
    solutions = []
    for pays in (0, 1, 3, 7, 20, NEVER):
        monkeypatch.setattr(program, "PAYS", pays)
        solutions.append(run_anew(RUNS["rebounds"]))
    for solution in solutions:
        assert_agree(solution, solutions[-1])


@pytest.mark.parametrize("pays", [0, NEVER])
def test_results_are_arrays_of_jax(pays: int, compiled: Made, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of strong types and on the default device, as those of other functions of jax."""
    monkeypatch.setattr(program, "PAYS", pays)
    (device,) = jax.devices()
    arrays = [leaf for leaf in jax.tree.leaves(simulate(charged(), 0.1)) if not isinstance(leaf, int | float | bool)]
    assert len(arrays) > 10
    for leaf in arrays:
        assert isinstance(leaf, jax.Array)
        assert not leaf.weak_type
        assert leaf.devices() == {device}


@pytest.mark.parametrize("pays", [0, NEVER])
def test_a_solution_keeps_its_numbers(pays: int, compiled: Made, monkeypatch: pytest.MonkeyPatch) -> None:
    """When those that were given change afterwards."""
    monkeypatch.setattr(program, "PAYS", pays)
    voltage, end, times = np.array(5.0), np.array(0.1), np.array([0.0, 0.02, 0.07])
    solution = simulate(charged(voltage), end, save=times)

    def numbers() -> list[Any]:
        read = [solution["parts[2].v"], solution["parts[0].V"], solution.ts, solution.t1]
        return [np.array(x) for x in (*read, solution.final.parts[0].V, solution.at(0.05).parts[2].v)]

    before = numbers()
    for given in (voltage, end, times):
        given *= 3.0
    for a, b in zip(numbers(), before, strict=True):
        np.testing.assert_array_equal(a, b)
    spring = tabulated_spring()
    solution = simulate(spring, 0.1)
    assert solution.final.parts[0].positions[0] == -0.1


@pytest.mark.parametrize(("chosen", "in_parts"), [("on", False), ("1", False), ("", True), ("off", True), (None, True)])
def test_the_choice_of_optimisation(chosen: str | None, in_parts: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(programs, "in_parts", None)
    if chosen is None:
        monkeypatch.delenv("ACAUSAL_OPTIMISE", raising=False)
    else:
        monkeypatch.setenv("ACAUSAL_OPTIMISE", chosen)
    before = options()["jax_disable_most_optimizations"]
    jax.config.update("jax_disable_most_optimizations", False)
    try:
        choose_optimisation()
        assert options()["jax_disable_most_optimizations"] == (chosen == "off")
        assert programs.in_parts == in_parts
    finally:
        jax.config.update("jax_disable_most_optimizations", before)


def test_a_failed_compilation_fails_the_run_and_not_the_next(compiled: Made, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(program, "PAYS", 2)
    whole, errors = stored_program._Store.compiled, [KeyboardInterrupt(), RuntimeError("out of space")]

    def failing(*arguments: Any) -> Any:
        if errors:
            raise errors.pop()
        return whole(*arguments)

    monkeypatch.setattr(stored_program._Store, "compiled", failing)
    with pytest.raises(RuntimeError, match="out of space"):
        simulate(charged(), 0.3)
    with pytest.raises(KeyboardInterrupt):
        simulate(charged(), 0.3)
    np.testing.assert_allclose(simulate(charged(), 0.3)["parts[2].v"][-1], 5.0 * (1 - np.exp(-3.0)), rtol=1e-5)


def test_threads_that_run_a_model(compiled: Made, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(program, "PAYS", 2)
    voltages = np.arange(1.0, 9.0)
    with ThreadPoolExecutor(4) as pool:
        ends = list(pool.map(lambda V: simulate(charged(V), 0.3, save="end")["parts[2].v"][-1], voltages))
    np.testing.assert_allclose(ends, voltages * (1 - np.exp(-3.0)), rtol=1e-5)
    assert len(set(compiled)) == len(compiled)


class Ending(Component):
    """dx/dt = (0.1 - t)^(1/2), which has no value later."""

    t: Time[Scalar, ""] = 0.0
    x: Var[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(rate=eq(d.x, jnp.sqrt(0.1 - self.t)))


def test_errors_of_a_run_are_found_by_both(compiled: Made, monkeypatch: pytest.MonkeyPatch) -> None:
    """NumPy, too, warns of no overflow and of no invalid number."""
    said = []
    for pays in (NEVER, 0):
        monkeypatch.setattr(program, "PAYS", pays)
        with pytest.raises(SimulationError) as error:
            run_anew(lambda: simulate(Ending(), 0.3))
        said.append(str(error.value))
    assert said[0] == said[1]


def test_a_part_with_many_steps_in_a_call_is_optimised_in_the_second_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(program, "PAYS", 0)
    store = Store()
    run = new_program(store, steps=program.REPAYS)
    for _ in range(3):
        assert run(27) == FOUND[27]
    levels = [level for part, level in store.made if part == "whole"]
    assert levels == [QUICK, OPTIMISED]


def test_a_loop_within_a_scan_is_compiled() -> None:
    def function(x: Any) -> Any:
        def long(x: Any) -> Any:
            return lax.while_loop(lambda s: s[0] < 500, lambda s: (s[0] + 1, s[1] * 0.99 + 0.01), (0, x))[1]

        return lax.map(long, x)

    store, x = Store(), np.array([0.0, 2.0, 3.0])
    (found,) = NumbersProgram(simplified(jax.make_jaxpr(function)(x)), store, 1)([x])
    np.testing.assert_allclose(found, function(x), rtol=1e-13)
    assert ("loop0", QUICK) in store.made
