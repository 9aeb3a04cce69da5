"""Batches of runs: alike to the runs one by one, interrupts, and what is said on the way."""

import _thread
import contextlib
import threading
import time
from collections.abc import Iterator
from typing import Any, Self

import jax
import numpy as np
import pytest
from _rigs import rig
from scipy.stats import norm

from acausal import Component, Discrete, Equations, Events, Param, Scalar, Var, eq, simulate, when
from acausal.design import Samples, Tolerance, Uniform, choose, sweep
from acausal.design._compute.cores import Bar, on_all_cores

pytestmark = pytest.mark.usefixtures("interruptible")


class Ball(Component):
    """A ball that rebounds without loss."""

    until: Param[Scalar, "s"] = 2.0
    g: Param[Scalar, "m/s2"] = 9.81
    h: Var[Scalar, "m"] = 1.0
    v: Var[Scalar, "m/s"] = 0.0
    impacts: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(speed=eq(d.h, self.v), fall=eq(d.v, -self.g))

    def events(self) -> Events:
        return dict(impact=when(self.h < 0.0, v=-self.v, impacts=self.impacts + 1.0))


RESULTS = {"height": lambda s: s.final.h, "impacts": lambda s: s.final.impacts}


def bounced(model: Ball) -> Any:
    return simulate(model, model.until, save="end", max_steps=10_000_000)


@pytest.mark.thorough
def test_a_batch_with_events_is_the_runs_one_by_one() -> None:
    """Members of very different numbers of impacts."""
    study = Tolerance(Ball(), {"g": Uniform(2.0, 1000.0)}, RESULTS, run=bounced)
    found = study.members(norm.ppf((np.arange(300) + 0.5) / 300)[:, None])
    one = jax.jit(lambda g: [f(bounced(Ball(g=g))) for f in RESULTS.values()])
    alone = np.array([one(g) for g in found.parameters[:, 0]])
    assert np.all(found.outcomes.are_good)
    np.testing.assert_allclose(found.outcomes.values, alone, rtol=1e-14, atol=1e-14)
    assert np.max(alone[:, 1]) > 20.0 * np.min(alone[:, 1])


def test_each_row_is_done_once_in_pieces_of_a_quarter_of_a_second() -> None:
    sizes: list[int] = []

    def work(rows: np.ndarray) -> np.ndarray:
        time.sleep(0.02 * len(rows))
        sizes.append(len(rows))
        return 2.0 * rows

    x, found = np.arange(101.0), np.full(101, np.nan)
    for rows, piece in on_all_cores(work, x):
        found[rows] = piece
    np.testing.assert_array_equal(found, 2.0 * x)
    assert 5 < max(sizes) <= 13
    assert not list(on_all_cores(work, x[:0]))


@contextlib.contextmanager
def interrupted_after(members: int) -> Iterator[Any]:
    """A progress function that interrupts the main thread a little after so many members are done."""
    times: list[float] = []

    def strike() -> None:
        times.append(time.monotonic())
        _thread.interrupt_main()

    def tell(done: int, total: int) -> None:
        if done >= members and not timers:
            timers.append(threading.Timer(0.2, strike))
            timers[0].start()

    timers: list[threading.Timer] = []
    yield tell
    assert time.monotonic() - times[0] < 2.0


def test_an_interrupt_returns_what_is_finished_while_long_runs_go_on() -> None:
    """The last members take several seconds each."""
    times = Samples(np.append(np.linspace(1e-3, 2e-3, 99), 400_000.0))
    study = Tolerance(Ball(), {"until": times}, RESULTS, run=bounced)
    scores = np.append(np.full(6, -1.0), np.full(6, 9.0))[:, None]
    with interrupted_after(4) as tell:
        found = study.monte_carlo(scores=scores, progress=tell)
    missing = found["height"].unfinished
    assert 6 <= missing <= 8
    assert len(found["height"].samples) == 12 - missing
    assert found["height"].failed == {}
    assert str(found).endswith(f"interrupted: {missing} members are missing")


def raising(members: int) -> Any:
    def tell(done: int, total: int) -> None:
        if done >= members:
            raise KeyboardInterrupt

    return tell


def test_indices_after_an_interrupt_are_those_of_whole_samples() -> None:
    even = {"link.c": Uniform(35.0, 45.0), "link.d": Uniform(1.0, 2.0)}
    study = Tolerance(rig(), even, lambda m: 2.0 * m.link.c + 10.0 * m.link.d)
    found = study.indices(1024, progress=raising(2000))
    assert 0 < found.unfinished <= 524
    assert found.lost == 0
    np.testing.assert_allclose(found.first[0], [0.8, 0.2], atol=0.05)
    assert str(found).endswith(f"interrupted: {found.unfinished} samples are missing")


def test_an_interrupt_before_anything_is_finished_is_raised() -> None:
    with pytest.raises(KeyboardInterrupt):
        Tolerance(rig(), {"link.c": Uniform(1.0, 2.0)}, lambda m: m.link.c).monte_carlo(8, progress=raising(0))


def test_the_first_failures_are_reported_in_logs(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("xarray")
    over = {"link.c": np.linspace(1.0, 3.0, 17)}
    sweep(rig(), over, {"root": lambda m: (1.45 - m.link.c) ** 0.5})
    lines = set(capsys.readouterr().err.splitlines())
    members = [
        f"sweep: member {4 + i} failed (no_finite_result): link.c = {1.5e-3 + 0.125e-3 * i:.6g} N/mm" for i in range(13)
    ]
    assert len(lines) == 5
    assert lines <= set(members)
    sweep(rig(), over, {"root": lambda m: (1.45 - m.link.c) ** 0.5}, progress=False)
    assert capsys.readouterr().err == ""


def test_a_log_has_a_line_with_rate_and_time_left_now_and_then(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("ACAUSAL_PROGRESS", raising=False)
    bar = Bar("sweep", None)
    for done, seconds in ((0, 0.0), (1, 2.0), (2, 5.0), (5, 12.0)):
        monkeypatch.setattr(time, "monotonic", lambda seconds=seconds: bar._began + seconds)
        bar(done, 12)
    assert capsys.readouterr().err == "sweep [############..................] 5 of 12, 0.4 per s, 18 s left\n"
    monkeypatch.setattr(time, "monotonic", lambda: bar._began + 30.0)
    bar(12, 12)
    assert capsys.readouterr().err == "sweep [##############################] 12 of 12, 30 s\n"


def test_a_short_study_says_nothing_in_a_log(capsys: pytest.CaptureFixture[str]) -> None:
    Tolerance(rig(), {"link.c": Uniform(1.0, 2.0)}, lambda m: m.link.c).monte_carlo(8)
    assert capsys.readouterr().err == ""


def test_an_interrupted_choice_names_the_combinations_that_are_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    tables = {"spring": [{"link.c": c} for c in np.linspace(10.0, 50.0, 300).tolist()]}
    monkeypatch.setattr(Bar, "__call__", lambda self, done, total: raising(1)(done, total))
    found = choose({"a": rig(), "b": rig()}, {"a": tables, "b": tables}, lambda m: m.link.c)
    missing = int(np.sum(~found.is_computed))
    assert 300 <= missing < 600
    assert f"The study was interrupted: {missing}" in str(found).replace("ruled out by ", "")
