"""Sweeps: what a dataset holds, stores that are gone on with, members that fail, workers that die."""

import concurrent.futures
import functools
import os
import subprocess
import sys
import threading
import time
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any, Self

import jax.numpy as jnp
import numpy as np
import pytest
from _rigs import Rig, rig
from scipy.stats import norm

from acausal import (
    ArgumentError,
    Component,
    Equations,
    ModelError,
    Param,
    ParameterError,
    Scalar,
    SimulationError,
    Var,
    eq,
    quantity,
    simulate,
)
from acausal.design import DesignWarning, Normal, Sample, sweep

xr = pytest.importorskip("xarray")
C, D, MASS = "link.c", "link.d", "mass.m"
GRID = {C: [20.0, 40.0, 80.0], MASS: ["500 g", "1 kg"]}


def frequency(model: Rig) -> Any:
    return (model.link.c / model.mass.m) ** 0.5


def first_passage(model: Rig) -> Any:
    return simulate(model, 0.3, until=lambda s: s.link.s_rel, save="end", rtol=1e-8, throw=False)


def test_a_grid_is_a_dataset_with_units() -> None:
    found = sweep(rig(), GRID, {"frequency": (frequency, "1/s")})
    assert found["frequency"].dims == (C, MASS)
    np.testing.assert_allclose(found[MASS], [0.5, 1.0])
    np.testing.assert_allclose(found["frequency"], np.sqrt(found[C] / found[MASS]), rtol=1e-14)
    assert found["frequency"].attrs["units"] == "1/s"
    assert found[C].attrs["units"] == "N/m"
    assert float(found["frequency"].sel({C: 40.0, MASS: 1.0})) == pytest.approx(np.sqrt(40.0), rel=1e-14)


def test_lists_tables_and_samples() -> None:
    pd = pytest.importorskip("pandas")
    rows = [{C: 20.0, MASS: 1.0}, {C: quantity(0.04, "N/mm"), MASS: "2000 g"}]
    found = sweep(rig(), rows, frequency)
    np.testing.assert_allclose(found["result"], np.sqrt([20.0, 20.0]))
    table = sweep(rig(), pd.DataFrame({C: [20.0, 45.0]}), {"f": frequency})
    np.testing.assert_allclose(table["f"], np.sqrt([20.0, 45.0]))
    sample = sweep(rig(), Sample({C: (10.0, 30.0), MASS: Normal(std="1 %")}, 256), {"f": frequency})
    assert sample["f"].dims == ("member",)
    # Of 2^8 points of a Sobol sequence, each of as many intervals of equal probability has one.
    for share in ((sample[C] - 10.0) / 20.0, norm.cdf(sample[MASS], 1.0, 0.01)):
        np.testing.assert_array_equal(np.sort(np.floor(256.0 * np.asarray(share))), np.arange(256))


@pytest.mark.thorough
def test_failed_members_keep_their_code() -> None:
    found = sweep(rig(), {C: [10.0, 40.0]}, {"time": (lambda s: s.t1, "ms")}, run=first_passage)
    names = found["code"].attrs["flag_meanings"].split()
    assert [names[code] for code in found["code"].values] == ["never_stopped", "computed"]
    assert np.isnan(found["time"][0])
    assert 240.0 < float(found["time"][1]) < 300.0
    assert len(found["code"].attrs["flag_values"]) == len(names)


def test_a_store_is_gone_on_with_and_read(tmp_path: Path) -> None:
    """A run that is interrupted in its third piece of four: the other two are not computed again."""
    pytest.importorskip("zarr")
    seen: list[int] = []

    class Once(concurrent.futures.Executor):
        def __init__(self, most: int) -> None:
            self.most = most

        def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Any:
            future: concurrent.futures.Future[Any] = concurrent.futures.Future()
            if self.most <= 0:
                future.set_running_or_notify_cancel()
                threading.Timer(0.5, future.set_exception, [KeyboardInterrupt()]).start()
            else:
                self.most -= 1
                seen.append(len(args[0]))
                future.set_result(fn(*args))
            return future

    over, store = {C: np.linspace(10.0, 50.0, 10)}, tmp_path / "kept.zarr"
    part = sweep(rig(), over, {"f": frequency}, store=store, executor=Once(2), chunk=3)
    assert seen == [3, 3]
    np.testing.assert_allclose(part["f"][:6], np.sqrt(over[C][:6]), rtol=1e-14)
    assert np.all(np.isnan(part["f"][6:]))
    names = part["code"].attrs["flag_meanings"].split()
    assert [names[code] for code in part["code"].values[6:]] == ["interrupted"] * 4
    found = sweep(rig(), over, {"f": frequency}, store=store, executor=Once(9))
    assert seen == [3, 3, 3, 1]
    np.testing.assert_allclose(found["f"], np.sqrt(over[C]), rtol=1e-14)
    again = sweep(rig(), over, {"f": frequency}, store=store, executor=Once(0))
    xr.testing.assert_identical(again, found)
    with xr.open_zarr(store, consolidated=False) as raw:
        np.testing.assert_array_equal(raw["code"], np.zeros(10))


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda: (rig(d=2.0), {C: [1.0, 2.0]}, {"f": frequency}), "its model has other parameter values"),
        (lambda: (rig(), {C: [1.0, 3.0]}, {"f": frequency}), "it has other parameters or values"),
        (lambda: (rig(), {D: [1.0, 2.0]}, {"f": frequency}), "it has other parameters or values"),
        (lambda: (rig(), {C: [1.0, 2.0]}, {"g": frequency}), "it has other results"),
        (lambda: (rig(), {C: [1.0, 2.0]}, {"f": lambda m: m.link.c}), "results have another definition"),
    ],
)
def test_the_store_of_another_study_is_refused(change: Any, text: str, tmp_path: Path) -> None:
    pytest.importorskip("zarr")
    store = tmp_path / "kept.zarr"
    sweep(rig(), {C: [1.0, 2.0]}, {"f": frequency}, store=store)
    model, over, results = change()
    with pytest.raises(ModelError, match=text):
        sweep(model, over, results, store=store)
    with xr.open_zarr(store, consolidated=False) as raw:
        np.testing.assert_allclose(raw["f"], np.sqrt([1.0, 2.0]))


def _scaled(inner: Any) -> Any:
    return lambda model: inner(model)


def _times(factor: Any) -> Any:
    return lambda model: jnp.sum(jnp.asarray(factor)) * model.link.c


def _partial(factor: float) -> Any:
    return functools.partial(lambda factor, model: factor * model.link.c, factor)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (_scaled(lambda m: m.link.c), _scaled(lambda m: 2.0 * m.link.c)),
        (_times((1.0,)), _times((2.0,))),
        (_times(jnp.ones(2)), _times(jnp.zeros(2))),
        (_partial(1.0), _partial(2.0)),
    ],
)
def test_what_a_function_closes_over_is_part_of_a_study(first: Any, second: Any, tmp_path: Path) -> None:
    pytest.importorskip("zarr")
    store = tmp_path / "kept.zarr"
    for _ in range(2):
        sweep(rig(), {C: [1.0, 2.0]}, {"f": first}, store=store)
    with pytest.raises(ModelError, match="its model, run or results have another definition"):
        sweep(rig(), {C: [1.0, 2.0]}, {"f": second}, store=store)


def test_a_folder_that_is_no_store_is_refused(tmp_path: Path) -> None:
    zarr = pytest.importorskip("zarr")
    zarr.open_group(tmp_path / "other.zarr", mode="w")
    with pytest.raises(ModelError, match="is not the store of a sweep"):
        sweep(rig(), GRID, frequency, store=tmp_path / "other.zarr")


@pytest.mark.parametrize("name", ["", "a/b", "..", ".hidden", "__reserved", "zarr.json"])
def test_names_that_a_store_cannot_keep(name: str, tmp_path: Path) -> None:
    pytest.importorskip("zarr")
    with pytest.raises(ModelError, match=r"cannot be the name of an array in a store\. Rename the result"):
        sweep(rig(), {C: [10.0]}, {name: frequency}, store=tmp_path / "kept.zarr")
    assert not (tmp_path / "kept.zarr").exists()


class Coded(Component):
    """A model whose own parameter has the name of a column."""

    code: Param[Scalar, "1"]
    x: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(self.x, self.code))


NAMES: dict[str, tuple[Any, Any, Any, str]] = {
    "a parameter": (rig(), {C: [1.0]}, {C: frequency}, f"'{C}' is the name of a result and of a parameter"),
    "the codes": (rig(), {C: [1.0]}, {"code": frequency}, "'code' is the name of a result and of the codes"),
    "the members": (rig(), [{C: 1.0}], {"member": frequency}, "'member' is the name of a result and of the members"),
    "two results": (
        *(rig(), {C: [1.0]}, {"f": lambda m: [m.link.c], "f[0]": frequency}),
        r"f\[0\] is the name of two results",
    ),
    "a column": (Coded(code=1.0), {"code": [1.0]}, {"f": lambda m: m.code}, "The parameter 'code' has the name of a"),
}


@pytest.mark.parametrize("case", NAMES)
def test_names_are_different(case: str) -> None:
    model, over, results, text = NAMES[case]
    with pytest.raises(ModelError, match=text):
        sweep(model, over, results)


KILLED = """
import sys
import numpy as np
from _rigs import rig
from test_sweep import first_passage, late
from acausal.design import sweep
sweep(rig(), {"link.c": np.linspace(40.0, 60.0, 2000)}, {"time": late}, run=first_passage, store=sys.argv[1], chunk=32)
"""


def late(s: Any) -> Any:
    return s.t1


@pytest.mark.slow
def test_a_killed_process_loses_nothing_that_was_finished(tmp_path: Path) -> None:
    """SIGKILL half-way; the same call computes the rest alone."""
    zarr = pytest.importorskip("zarr")
    store = tmp_path / "kept.zarr"
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path])}
    process = subprocess.Popen([sys.executable, "-c", KILLED, str(store)], env=env)
    finished = 0
    deadline = time.monotonic() + 300.0
    while finished < 10 and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.05)
        if (store / "code" / "c").exists():
            finished = len(list((store / "code" / "c").iterdir()))
    process.kill()
    process.wait()
    codes = np.asarray(zarr.open_group(store, mode="r")["code"][:])
    before = np.asarray(zarr.open_group(store, mode="r")["time"][:])
    kept = codes >= 0
    assert 0 < np.sum(kept) < 2000
    over = {C: np.linspace(40.0, 60.0, 2000)}
    found = sweep(rig(), over, {"time": late}, run=first_passage, store=store)
    assert np.all(found["code"] == 0)
    np.testing.assert_array_equal(found["time"].values[kept], before[kept])
    few = sweep(rig(), {C: over[C][::400]}, {"time": late}, run=first_passage)
    np.testing.assert_allclose(found["time"].values[::400], few["time"], rtol=1e-9)


class Dying(concurrent.futures.Executor):
    """Its second worker dies."""

    def __init__(self) -> None:
        self.left = 1

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Any:
        future: concurrent.futures.Future[Any] = concurrent.futures.Future()
        self.left -= 1
        if self.left < 0:
            future.set_running_or_notify_cancel()
            threading.Timer(0.5, future.set_exception, [BrokenProcessPool("a child was killed")]).start()
        else:
            future.set_result(fn(*args))
        return future


def test_a_worker_that_dies(tmp_path: Path) -> None:
    pytest.importorskip("zarr")
    over = {C: np.linspace(10.0, 50.0, 9)}
    with pytest.warns(DesignWarning, match=r"Only 3 of 9 members .* because a worker died\. They are in the result"):
        found = sweep(rig(), over, {"f": frequency}, executor=Dying(), chunk=3)
    np.testing.assert_allclose(found["f"][found["code"] == 0], np.sqrt(over[C][:3]), rtol=1e-14)
    store = tmp_path / "kept.zarr"
    with pytest.raises(SimulationError, match="the same call resumes from there"):
        sweep(rig(), over, {"f": frequency}, executor=Dying(), chunk=3, store=store)
    found = sweep(rig(), over, {"f": frequency}, store=store)
    np.testing.assert_allclose(found["f"], np.sqrt(over[C]), rtol=1e-14)


@pytest.mark.thorough
def test_processes(tmp_path: Path) -> None:
    """A pool of one process, which compiles for itself once."""
    import multiprocessing

    context = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=context) as pool:
        found = sweep(rig(), {C: [10.0, 20.0, 30.0]}, {"f": frequency}, executor=pool, chunk=2)
    np.testing.assert_allclose(found["f"], np.sqrt([10.0, 20.0, 30.0]), rtol=1e-14)


def test_the_bar(capsys: pytest.CaptureFixture[str]) -> None:
    sweep(rig(), {C: np.linspace(1.0, 2.0, 6)}, frequency, chunk=2, progress=True)
    said = capsys.readouterr().err
    assert "sweep [##############################] 6 of 6" in said
    sweep(rig(), {C: [1.0]}, frequency, progress=False)
    assert capsys.readouterr().err == ""


BAD: dict[str, tuple[Any, type[Exception], str]] = {
    "nothing": ([], ModelError, "over must be a dictionary of values, a list of dictionaries or a Sample"),
    "one value": ({C: 3.0}, ParameterError, "link.c: give a sequence of values"),
    "not a number": ({C: [1.0, float("nan")]}, ParameterError, "link.c: values must be finite"),
    "other unit": ({C: quantity(np.array([1.0, 2.0]), "m")}, ParameterError, "link.c is in N/m"),
    "unknown": ({"link.k": [1.0]}, ModelError, "no parameter or start value 'link.k'"),
    "other names": ([{C: 1.0}, {D: 1.0}], ModelError, "Member 1 names link.d, but the first member names link.c"),
    "no bounds": (Sample({C: (None, None)}, 8), ParameterError, "a sample needs two finite bounds"),
    "too many": ({C: range(10_000), D: range(10_000)}, ModelError, "is too large. Use a Sample"),
}


def test_an_executor_that_is_none() -> None:
    wrong: Any = 3
    with pytest.raises(ArgumentError, match=r"must return a concurrent\.futures\.Future; got int"):
        sweep(rig(), {C: [10.0, 20.0]}, {"f": frequency}, executor=wrong)


@pytest.mark.parametrize("case", BAD)
def test_bad_input(case: str) -> None:
    over, error, text = BAD[case]
    with pytest.raises(error, match=text):
        sweep(rig(), over, frequency)
