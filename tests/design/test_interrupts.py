"""Searches that are interrupted, that fail from the first designs on, and what they say on the way."""

import _thread
import threading
import time
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from _problems import GearedLoad, Valleys

from acausal import SimulationError, _progress
from acausal.design import identify, optimise, pareto
from acausal.design._compute.cores import interruptible
from acausal.design._compute.evaluator import Evaluator
from acausal.design._identify.experiment import Experiment
from acausal.design._optimise import report

pytestmark = pytest.mark.usefixtures("interruptible")

RATIO = {"ratio": (5.0, 40.0)}
BOTH = {"time": (lambda m: m.time, "ms"), "motor speed": (lambda m: m.motor_speed, "rad/s")}


def test_work_in_a_thread_leaves_the_main_thread_interruptible() -> None:
    began = time.monotonic()
    threading.Timer(0.3, _thread.interrupt_main).start()
    with pytest.raises(KeyboardInterrupt):
        interruptible(lambda: time.sleep(4.0))
    assert time.monotonic() - began < 2.3


@pytest.mark.thorough
def test_an_interrupted_front_has_the_designs_so_far(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = pareto(GearedLoad(), RATIO, BOTH, points=5)
    assert not whole.is_interrupted
    evaluate = Evaluator._evaluate

    def interrupted(self: Evaluator, x: np.ndarray) -> Any:
        if self.evaluations == 32:
            raise KeyboardInterrupt
        return evaluate(self, x)

    monkeypatch.setattr(Evaluator, "_evaluate", interrupted)
    part = pareto(GearedLoad(), RATIO, BOTH, points=5)
    assert part.is_interrupted
    assert 2 <= len(part.designs) < 5
    np.testing.assert_array_equal(part.values[-1], whole.values[-1])
    assert str(part).endswith("interrupted: designs are missing")


def test_first_designs_that_fail_alike_end_a_search(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[np.ndarray] = []
    evaluate = Evaluator._evaluate
    monkeypatch.setattr(Evaluator, "_evaluate", lambda self, x: (seen.append(x), evaluate(self, x))[1])
    text = r"The start and 4 designs spread between the bounds all fail alike: time is nan\. Start from a design"
    for search in (optimise, pareto):
        seen.clear()
        results = {"time": lambda m: m.time * jnp.nan, "speed": lambda m: m.motor_speed}
        with pytest.raises(SimulationError, match=text):
            search(GearedLoad(), RATIO, results if search is pareto else {"time": results["time"]})
        assert len(seen) <= 6


@pytest.mark.thorough
def test_first_starts_of_a_fit_that_fail_end_it(monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[int] = []
    from acausal.design._identify import least_squares

    solve = least_squares.solved
    monkeypatch.setattr(least_squares, "solved", lambda *work: (found.append(1), solve(*work))[1])
    experiment = Experiment(lambda m: {"a": m.x * jnp.nan}, {"a": 0.0}, {"a": 1.0})
    message = r"^experiment 1: a is nan\. The fit cannot start with x = 1500 mm, nor from 63 other points"
    with pytest.raises(SimulationError, match=message):
        identify(Valleys(), {"x": (-3.0, 3.0)}, experiment, starts=64)
    assert len(found) < 16


def test_a_search_reports_its_first_failures_and_how_far_it_is(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(report, "EVERY", 0.0)
    monkeypatch.setattr(report, "PAUSE", 1000.0)
    monkeypatch.setattr(_progress, "DELAY", 1000.0)

    def time(m: GearedLoad) -> Any:
        return jnp.where(m.ratio > 19.5, jnp.inf, m.time)

    optimise(GearedLoad(), {"ratio": (2.0, 100.0)}, {"time": time}, start={"ratio": 50.0})
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "design 1 failed: time is inf, ratio = 50"
    assert lines[1].startswith("1 design, 1 failed, ")
    assert sum("failed:" in line for line in lines) == 5
    optimise(GearedLoad(), {"ratio": (2.0, 100.0)}, {"time": time}, start={"ratio": 50.0}, progress=False)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("progress", [None, False])
def test_a_log_has_the_compilation_and_the_iterations(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, progress: bool | None
) -> None:
    monkeypatch.delenv("ACAUSAL_PROGRESS", raising=False)
    monkeypatch.setattr(_progress, "DELAY", 0.0)
    monkeypatch.setattr(report, "PAUSE", 0.0)
    optimise(GearedLoad(), RATIO, {"time": (lambda m: m.time, "ms")}, sensitivities=False, progress=progress)
    lines = capsys.readouterr().err.splitlines()
    if progress is False:
        assert lines == []
        return
    assert lines[0] == "Compiling the results and their derivatives of GearedLoad ..."
    assert lines[1].startswith("Compiled the results and their derivatives of GearedLoad in ")
    assert lines[2].startswith("step 0: time ")
    assert lines[-1].startswith("step ")


# On a busy machine the interrupt can come before the searches have begun, and is then raised.
@pytest.mark.slow
def test_an_interrupt_ends_several_starts_while_their_runs_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """All searches hang in a run of several seconds. Their threads outlive this test, so it comes last."""
    evaluate, lock, struck = Evaluator._evaluate, threading.Lock(), []

    def slow(self: Evaluator, x: np.ndarray) -> Any:
        if self.evaluations < 12 or threading.current_thread() is threading.main_thread():
            return evaluate(self, x)
        with lock:
            if not struck:
                struck.append(time.monotonic())
                _thread.interrupt_main()
        time.sleep(4.0)
        return evaluate(self, x)

    monkeypatch.setattr(Evaluator, "_evaluate", slow)
    design = optimise(Valleys(x=2.5), {"x": (-3.0, 3.0)}, lambda m: m.height, starts=4)
    assert time.monotonic() - struck[0] < 2.0
    assert design.status == "interrupted"
    assert design.objective < float(Valleys(x=2.5).height)
