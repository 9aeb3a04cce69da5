"""What a study has found is kept if something fails later."""

import concurrent.futures
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from _problems import GearedLoad, Valleys

from acausal import Component, Param, ParameterError, Requirements, Scalar, positive, replace, require
from acausal.design import Design, DesignWarning, Tolerance, Uniform, choose, optimise, pareto, sweep, train
from acausal.design._compute.evaluator import Evaluator
from acausal.design._sweep.batches import Batch
from acausal.design._sweep.pieces import Store

RATIO = {"ratio": (2.0, 100.0)}


class Vessel(Component):
    """A vessel that holds less liquid than its volume."""

    volume: Param[Scalar, "m3", positive] = 1.0
    capacity: Param[Scalar, "m3", positive] = 0.5
    cells: Param[Any, "m3"] = 1.0

    def requirements(self) -> Requirements:
        return (require(self.capacity < self.volume, "capacity must be below volume"),)


def test_an_optimum_that_no_component_takes_keeps_its_numbers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The run has a capacity of its own, so it does not meet the requirement of the model."""
    design = optimise(
        Vessel(), {"volume": (0.1, 3.0)}, lambda v: (v - 0.3) ** 2, run=lambda m: 1.0 * m.volume, sensitivities=False
    )
    said = capsys.readouterr().err.splitlines()
    assert said[0].startswith(
        "corner of the bounds: volume = 100000 cm3 cannot be built: capacity must be below volume"
    )
    assert said[1].startswith("Narrow the bounds, or state the condition as a constraint")
    assert design.values["volume"] == pytest.approx(0.3)
    assert "no model can be built with these values: capacity must be below volume, got capacity" in str(design)
    with pytest.raises(ParameterError, match=r"No model can be built with volume = 300000 cm3: capacity must be below"):
        _ = design.model
    design.save(tmp_path / "design")
    assert Design.load(tmp_path / "design").values == design.values
    assert "300000" in design.html()


def test_corners_come_before_the_first_design(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Any two of many variables meet at both of their bounds."""

    def none(self: Evaluator, x: np.ndarray) -> Any:
        raise RuntimeError("nothing is computed")

    monkeypatch.setattr(Evaluator, "_evaluate", none)
    model = replace(Vessel(), {"cells": np.ones(9)})
    free: Any = {"volume": (0.4, 3.0), "capacity": (0.05, 0.6)}
    for bounds in (free, free | {"cells": (0.0, 2.0)}):
        with pytest.raises(RuntimeError):
            optimise(model, bounds, lambda m: m.volume)
        said = capsys.readouterr().err
        assert "volume = 400000 cm3, capacity = 600000 cm3" in said
        assert "capacity = 50000 cm3" not in said
        with pytest.raises(RuntimeError):
            optimise(model, bounds, lambda m: m.volume, progress=False)
        assert capsys.readouterr().err == ""


def failing(monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    """Evaluations after some raise an error."""
    evaluate = Evaluator._evaluate

    def limited(self: Evaluator, x: np.ndarray) -> Any:
        if self.evaluations >= number:
            raise RuntimeError("out of memory")
        return evaluate(self, x)

    monkeypatch.setattr(Evaluator, "_evaluate", limited)


@pytest.mark.thorough
@pytest.mark.parametrize("starts", [1, 3])
def test_an_error_on_the_way_keeps_the_best_design(monkeypatch: pytest.MonkeyPatch, starts: int) -> None:
    time = {"time": lambda m: m.time}
    total = optimise(GearedLoad(), RATIO, time, starts=starts, sensitivities=False).total_evaluations
    for number in range(3, total, 4):
        with monkeypatch.context() as patch:
            failing(patch, number)
            with pytest.warns(DesignWarning, match="out of memory"):
                design = optimise(GearedLoad(), RATIO, time, starts=starts, sensitivities=False)
        assert design.status in ("interrupted", "optimal")
        assert design.objective <= float(GearedLoad().time)


@pytest.mark.thorough
def test_a_design_without_sensitivities_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    def none(self: Evaluator, x: np.ndarray, weights: np.ndarray) -> Any:
        raise RuntimeError("out of memory")

    monkeypatch.setattr(Evaluator, "sensitivity", none)
    with pytest.warns(DesignWarning, match="The design has no sensitivities: out of memory"):
        design = optimise(GearedLoad(), RATIO, lambda m: m.time)
    assert design.status == "optimal"
    assert not design.sensitivities.rows


@pytest.mark.thorough
def test_an_error_keeps_the_finished_part_of_a_front(monkeypatch: pytest.MonkeyPatch) -> None:
    failing(monkeypatch, 32)
    both = {"time": lambda m: m.time, "speed": lambda m: m.motor_speed}
    with pytest.warns(DesignWarning, match="out of memory"):
        part = pareto(GearedLoad(), RATIO, both, points=5)
    assert part.is_interrupted
    assert 2 <= len(part.designs) < 5


def test_an_error_of_a_piece_keeps_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    compute, limit = Batch.__call__, 1.5

    def limited(self: Batch, x: np.ndarray) -> Any:
        if np.any(x > limit):
            raise RuntimeError("out of memory")
        return compute(self, x)

    monkeypatch.setattr(Batch, "__call__", limited)
    values, results = np.linspace(-2.0, 2.0, 12), {"height": lambda m: m.height}

    class InOrder(concurrent.futures.Executor):
        def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Any:
            future: concurrent.futures.Future[Any] = concurrent.futures.Future()
            try:
                future.set_result(fn(*args))
            except RuntimeError as error:
                future.set_exception(error)
            return future

    for executor in (None, InOrder()):
        with pytest.warns(DesignWarning, match="because out of memory. They are in the result"):
            found = sweep(Valleys(), {"x": values}, results, executor=executor, chunk=1)
        good = found["code"].values == 0
        assert np.any(good)
        expected = (values**2 - 1.0) ** 2 + 0.1 * values
        np.testing.assert_allclose(found["height"].values[good], expected[good], rtol=1e-12)
        assert np.all(np.isnan(found["height"].values[~good]))
    with pytest.raises(RuntimeError, match="out of memory"):
        sweep(Valleys(), {"x": [1.8, 1.9]}, results)
    places = [{"x": x} for x in np.linspace(-2.0, 2.0, 80).tolist()]
    with pytest.warns(DesignWarning, match="of the combinations could be computed, because out of memory"):
        choice = choose(Valleys(), {"place": places}, results, executor=InOrder())
    assert choice.best is not None
    limit = -10.0
    with pytest.raises(RuntimeError, match="out of memory"):
        Tolerance(Valleys(), {"x": Uniform(1.0, 2.0)}, results).monte_carlo(8)


def test_a_store_that_cannot_be_written_keeps_the_results(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    pytest.importorskip("zarr")
    values, results = np.linspace(-2.0, 2.0, 9), {"height": lambda m: m.height}

    class Full:
        def __init__(self, column: Any) -> None:
            self.column, self.left = column, 1

        def __setitem__(self, where: Any, value: Any) -> None:
            self.left -= 1
            if self.left < 0:
                raise OSError("No space left on device")
            self.column[where] = value

    made = Store.__init__

    def limited(self: Store, *given: Any) -> None:
        made(self, *given)
        self._column_of_codes = Full(self._column_of_codes)

    store, expected = tmp_path / "study.zarr", (values**2 - 1.0) ** 2 + 0.1 * values
    with monkeypatch.context() as patch:
        patch.setattr(Store, "__init__", limited)
        with pytest.warns(DesignWarning, match="could not be written .* No space left"):
            found = sweep(Valleys(), {"x": values}, results, store=store, chunk=3)
    np.testing.assert_allclose(found["height"], expected, rtol=1e-12)
    np.testing.assert_allclose(sweep(Valleys(), {"x": values}, results, store=store, chunk=3)["height"], expected)


def test_a_training_that_leaves_what_can_be_computed_keeps_its_best() -> None:
    optax: Any = pytest.importorskip("optax")

    def loss(m: Valleys) -> Any:
        return jnp.where(m.x > 0.5, (m.x - 0.2) ** 2, jnp.nan)

    with pytest.warns(DesignWarning, match="The loss or its gradient is not finite before step"):
        found = train(Valleys(), ["x"], loss, optimiser=optax.sgd(0.2))
    assert float(found.model.x) > 0.5
    assert float(found.values["x"]) == float(found.model.x)
    assert found.losses[-1] < found.losses[0]


def test_trained_values_that_no_component_takes_are_kept() -> None:
    optax: Any = pytest.importorskip("optax")
    found = train(
        Vessel(), ["volume"], lambda m: (jnp.asarray(m.volume) - 0.3) ** 2, optimiser=optax.sgd(0.3), steps=20
    )
    assert float(found.values["volume"]) == pytest.approx(0.3, abs=1e-3)
    assert "capacity must be below volume" in found.unbuilt
    with pytest.raises(ParameterError, match="No model can be built with the trained values"):
        _ = found.model
