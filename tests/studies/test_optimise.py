"""Optima by gradient."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from _thesis_reference import OPTIMA

from studies.optimise import PROBLEMS, NoMinimumError, Point, minimise

KEYS = {
    "actuator", "parameter", "unit", "start", "optimum", "opening_time_start", "opening_time_optimum",
    "gradient_at_optimum", "simulations",
}  # fmt: skip


@pytest.mark.thorough
def test_rows(optimised: list[dict[str, Any]]) -> None:
    assert [row["actuator"] for row in optimised] == [optimum[0] for optimum in OPTIMA]
    for row, (_, parameter, value, time) in zip(optimised, OPTIMA, strict=True):
        assert set(row) == KEYS
        assert row["parameter"] == parameter
        assert abs(math.log(row["start"] / value)) > math.log(2.0)
        assert row["optimum"] == pytest.approx(value, rel=1e-5)
        assert row["opening_time_optimum"] == pytest.approx(time, rel=1e-7)
        assert row["opening_time_start"] > row["opening_time_optimum"]
        assert abs(row["gradient_at_optimum"] * value / time) < 1e-5
        assert row["simulations"] < 15


@pytest.mark.thorough
def test_pictures(optimised: list[dict[str, Any]], folder: Path) -> None:
    assert (folder / "pictures" / "optimise.png").stat().st_size > 10_000
    assert "data:image/png" in (folder / "pictures" / "optimise.html").read_text()


@pytest.mark.thorough
@pytest.mark.parametrize("factor", [0.2, 0.5, 2.0, 5.0])
@pytest.mark.parametrize("number", range(len(PROBLEMS)))
def test_other_starts(number: int, factor: float) -> None:
    """Some of these starts never open."""
    problem, (_, _, value, time) = PROBLEMS[number], OPTIMA[number]
    path = minimise(problem.evaluate, factor * value)
    assert path[-1].x == pytest.approx(value, rel=1e-5)
    assert path[-1].value == pytest.approx(time, rel=1e-7)
    assert len(path) < 20
    assert not any(math.isnan(point.value) or math.isnan(point.slope) for point in path)


@pytest.mark.thorough
@pytest.mark.parametrize("problem", PROBLEMS, ids=lambda problem: problem.actuator)
def test_sweep_is_single_runs(problem: Any) -> None:
    values, times = problem.sweep()
    assert np.any(np.isinf(times))
    for i in range(0, len(values), 9):
        assert times[i] == pytest.approx(problem.evaluate(values[i])[0], rel=1e-8)


def _walled(low: float, high: float) -> Any:
    """f = x + 1/x, infinite outside of (low, high)."""
    return lambda x: (x + 1.0 / x, 1.0 - 1.0 / x**2) if low < x < high else (math.inf, 0.0)


@pytest.mark.parametrize("start", [0.05, 0.3, 0.93, 1.0, 1.4, 3.0, 40.0])
@pytest.mark.parametrize("walls", [(0.0, math.inf), (0.9, math.inf), (0.0, 1.1), (0.9, 2.5)])
def test_minimise_with_walls(start: float, walls: tuple[float, float]) -> None:
    path = minimise(_walled(*walls), start)
    assert path[-1].x == pytest.approx(1.0, rel=1e-6)
    assert all(point.is_finite == (walls[0] < point.x < walls[1]) for point in path)


def test_minimise_next_to_a_wall() -> None:
    """A steep valley between a wall and a long slope."""

    def evaluate(x: float) -> tuple[float, float]:
        return (x + 1e-6 / (x - 1.0), 1.0 - 1e-6 / (x - 1.0) ** 2) if x > 1.0 else (math.inf, 0.0)

    path = minimise(evaluate, 30.0)
    assert path[-1].x == pytest.approx(1.001, rel=1e-6)


def test_minimise_gives_up() -> None:
    with pytest.raises(NoMinimumError, match="infinite at 1"):
        minimise(lambda x: (math.inf, 0.0), 1.0)
    with pytest.raises(NoMinimumError, match="60 evaluations"):
        minimise(lambda x: (-math.log(x), -1.0 / x), 1.0)


@pytest.mark.thorough
def test_points() -> None:
    assert Point(2.0, 1.0, 3.0).log_slope == 6.0
