"""`python -m studies optimise`."""

import dataclasses
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from jaxtyping import Float

from acausal import Table

from .._output import ACTUATOR_NAMES, print_table, progress, require_matplotlib, save, write_json
from ._minimise import Point
from ._problems import PROBLEMS, Problem

HEADS = (
    "actuator", "parameter", "unit", "start", "optimum", "time at start [ms]", "time at optimum [ms]",
    "gradient [ms per unit]", "simulations", "best of the sweep",
)  # fmt: skip
ABOUT = """Gear ratio and pump displacement that open the clutch soonest, with all other parameters as in the thesis.

The search uses the derivative of the opening time. A sweep verifies each optimum.
"""
SHOWN = (
    "Curves are computed with the model. Diamonds are the measured prototypes of the thesis; `validate` compares both."
)


@dataclasses.dataclass(frozen=True)
class Row:
    """The optimum of one actuator, in SI units; the gradient in s per unit of the parameter."""

    actuator: str
    parameter: str
    unit: str
    start: float
    optimum: float
    opening_time_start: float
    opening_time_optimum: float
    gradient_at_optimum: float
    simulations: int


@dataclasses.dataclass(frozen=True)
class Outcome:
    """The path of the optimiser and the sweep that verifies it."""

    problem: Problem
    path: list[Point]
    values: Float[np.ndarray, " n"]
    times: Float[np.ndarray, " n"]

    @property
    def row(self) -> Row:
        problem, first, last = self.problem, self.path[0], self.path[-1]
        return Row(
            problem.actuator, problem.parameter, problem.unit, first.x, last.x, first.value, last.value, last.slope,
            len(self.path),
        )  # fmt: skip

    @property
    def best_of_sweep(self) -> float:
        return float(self.values[np.argmin(self.times)])

    def check(self) -> None:
        """Raises an error unless the optimum is at least as good as the best point of the sweep, and next to it."""
        best = int(np.argmin(self.times))
        around = self.values[max(best - 1, 0)], self.values[min(best + 1, len(self.values) - 1)]
        last = self.path[-1]
        if not (around[0] <= last.x <= around[1] and last.value <= self.times[best] * (1.0 + 1e-6)):
            raise AssertionError(
                f"The optimum {last} disagrees with the best point of the sweep, {self.best_of_sweep}."
            )


def solve(problem: Problem, rtol: float = 1e-9, points: int = 64) -> Outcome:
    """Optimise, and verify the optimum with a sweep."""
    outcome = Outcome(problem, problem.solve(rtol), *problem.sweep(points, rtol))
    outcome.check()
    return outcome


def main(json: Path | None = None, out: Path | None = None, rtol: float = 1e-9) -> list[Row]:
    """Optimise, print, and write rows to the file `json`, a picture and a report to the folder `out`."""
    if out is not None:
        require_matplotlib()
    outcomes = [solve(problem, rtol) for problem in progress(PROBLEMS, "optimising")]
    rows = [outcome.row for outcome in outcomes]
    cells = list(_cells(outcomes))
    print_table("Minimum opening time", HEADS, cells)
    if json is not None:
        write_json(json, rows)
    if out is not None:
        _report(outcomes, cells, out)
    return rows


def _report(outcomes: list[Outcome], cells: list[tuple[str, ...]], out: Path) -> None:
    from .._report import write_report
    from ._plot import plot_optima

    picture = plot_optima(outcomes)
    save(picture, out, "optimise")
    parts = [
        ("Optima", Table(HEADS, cells), []),
        ("Opening time over ratio and displacement", SHOWN, [picture]),
    ]
    write_report(out, "optimise", "Ratio and displacement of shortest opening time", parts, ABOUT)


def _cells(outcomes: list[Outcome]) -> Iterable[tuple[str, ...]]:
    """Table cells, in display units."""
    for outcome in outcomes:
        scale, row = outcome.problem.scale, outcome.row
        yield (
            ACTUATOR_NAMES[row.actuator], row.parameter, scale.unit, f"{scale.value(row.start):.5g}",
            f"{scale.value(row.optimum):.7g}", f"{1e3 * row.opening_time_start:.6g}",
            f"{1e3 * row.opening_time_optimum:.6g}", f"{1e3 * row.gradient_at_optimum * scale.factor:.1e}",
            str(row.simulations), f"{scale.value(outcome.best_of_sweep):.4g}",
        )  # fmt: skip
