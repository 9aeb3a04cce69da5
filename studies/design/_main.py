"""`python -m studies design`."""

import dataclasses
import functools as ft
from collections.abc import Iterable, Mapping
from pathlib import Path

from acausal import Table
from acausal.design import Design

from .._output import finished, prices_of, print_table, progress, require_matplotlib, resumed, save, write_json
from .._report import write_report
from ._problems import PROBLEMS

ABOUT = """Parameters of clutch actuators that minimise the opening time within limits.

Each certificate shows the design, the margins of its limits, the multipliers of the active limits, and the
sensitivities to the fixed parameters.
"""
HEADS = (
    "problem", "starts", "opening time [ms]", "status", "KKT residual", "active limits and multipliers", "simulations",
)  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Row:
    """The result of one start of a problem, in SI units; multipliers in s per unit of the limit."""

    problem: str
    start: Mapping[str, float]
    variables: Mapping[str, float]
    objective: float
    constraints: Mapping[str, float]
    kkt_residual: float
    active: Mapping[str, float]
    status: str
    simulations: int
    seconds: float


def main(json: Path | None = None, out: Path | None = None, rtol: float = 1e-9) -> list[Row]:
    """Optimise, print each certificate, and write rows to the file `json` and a report to the folder `out`.

    With `out`, an interrupted study can be resumed.
    """
    if out is not None:
        require_matplotlib()
    designs: dict[str, Design] = {}
    for number, problem in enumerate(progress(PROBLEMS, "designing")):
        designs[problem.name] = resumed(out, f"design_{number}_{rtol:g}", ft.partial(problem.solve, rtol))
        print(f"\n{problem.name}\n{'=' * len(problem.name)}\n{designs[problem.name]}")
    rows = [_row(name, end) for name, best in designs.items() for end in (best, *best.others)]
    print()
    print_table("Shortest opening times", HEADS, _cells(designs))
    if json is not None:
        write_json(json, rows)
    if out is not None:
        _report(designs, out, rtol)
    finished(out)
    return rows


def _row(name: str, design: Design) -> Row:
    return Row(
        name, dict(zip(design.free.names, design.start.tolist(), strict=True)), design.values, design.objective,
        {result.limit.name: result.value for result in design.results}, design.kkt_residual, design.multipliers,
        design.status, design.evaluations, design.seconds,
    )  # fmt: skip


def _cells(designs: Mapping[str, Design]) -> Iterable[tuple[str, ...]]:
    for name, design in designs.items():
        scale = design.objective_scale
        yield (
            name, str(len(design.others) + 1), f"{scale.value(design.objective):.6g}", design.status,
            f"{design.kkt_residual:.1e}", prices_of(design), str(design.total_evaluations),
        )  # fmt: skip


def _report(designs: Mapping[str, Design], out: Path, rtol: float) -> None:
    from ._plot import plot_opening

    """Writes the pictures of all problems, and one page with them and the certificates."""
    problems = {problem.name: problem for problem in PROBLEMS}
    pictures = {name: plot_opening(problems[name], design, rtol) for name, design in designs.items()}
    for number, figure in enumerate(pictures.values(), start=1):
        save(figure, out, f"design_{number}")
    parts = [(name, str(design), [pictures[name]]) for name, design in designs.items()]
    parts += [(f"{name}: the search", "", [design.plot()]) for name, design in designs.items()]
    overview = ("Overview", Table(HEADS, list(_cells(designs))), [])
    write_report(out, "design", "Shortest opening times within limits", [overview, *parts], ABOUT)
