"""`python -m studies concepts`."""

from collections.abc import Sequence
from pathlib import Path

from acausal import Table
from acausal.design import Choice

from .._output import print_table, progress, require_matplotlib, write_json
from . import _products as products
from ._concepts import EHS, EMA, MOTORS
from ._rows import (
    DISTANCE_HEADS,
    HEADS,
    STATEMENT_HEADS,
    Distance,
    Row,
    Statement,
    cells,
    distance_cells,
    distances,
    on_front,
    optima,
    prices,
    prototypes,
    solved,
    statements,
    with_less_friction,
)

ABOUT = """Two concepts that open the clutch of a car, as in Meloni's thesis (Torino, 2012): motor, gearbox, cam and
master cylinder (EMA), and motor and pump (EHS), where either the motor or a valve holds the clutch open.

All sizes that the thesis chose by hand are free: ratio or displacement, bores, cam, supply and motor. The targets are
those of the thesis: an opening time of 200 ms, for the EHS 100 ms, motors below 250 W, 800 N at the slave. The limits
on current, pressure, speed and cam are those of the parts, or typical values.
"""
POINTS = 7  # of a front
FRONTS = [(concept, motor) for concept in (EMA, EHS) for motor in MOTORS[1:3]]


def main(json: Path | None = None, out: Path | None = None, rtol: float = 1e-9) -> list[Row]:
    """Design, print, and write rows to the file `json`, pictures and a report to the folder `out`."""
    if out is not None:
        require_matplotlib()
    rows, said = study(rtol), statements(rtol)
    away = distances(rows)
    choice = products.study()
    bought = products.front(choice)
    fronts = [
        row
        for concept, motor in progress(FRONTS, "drawing fronts")
        for row in on_front(concept, motor, concept.front(motor, POINTS))
    ]
    print_table("Designs under 800 N", HEADS, cells(rows))
    print(f"Active limits of the optima and their multipliers\n{prices(rows)}\n")
    print_table("Prototypes compared with the optimum of their concept", DISTANCE_HEADS, distance_cells(away))
    print_table("Pareto fronts of opening time and holding energy, within the target of 200 ms", HEADS, cells(fronts))
    print_table(
        "Pareto-optimal products in opening time, holding energy and mass", products.HEADS, products.cells(bought)
    )
    print(f"{choice}\n")
    print_table("Ratios", STATEMENT_HEADS, _said(said))
    if json is not None:
        write_json(json, rows, distances=away, fronts=fronts, products=bought, statements=said)
    if out is not None:
        _report(rows, away, fronts, bought, choice, said, out)
    return rows


def study(rtol: float = 1e-9) -> list[Row]:
    """Rows of the prototypes, then of the optimum of each concept with each admissible motor, the fastest first."""
    found = [solved(concept, motor) for concept, motor in progress(optima(), "designing")]
    best = sorted((row for row in found if row is not None), key=lambda row: (row.design, row.opening_time))
    return [*prototypes(rtol), *best, with_less_friction()]


def _said(said: Sequence[Statement]) -> list[tuple[str, ...]]:
    return [(one.statement, f"{one.thesis:g}", f"{one.value:.4g}", one.remark) for one in said]


def _report(
    rows: Sequence[Row],
    away: Sequence[Distance],
    fronts: Sequence[Row],
    bought: Sequence[Row],
    choice: Choice,
    said: Sequence[Statement],
    out: Path,
) -> None:
    from .._output import save
    from .._report import write_report
    from ._plot import plot_designs

    picture = plot_designs(rows, fronts, bought)
    save(picture, out, "concepts")
    parts = [
        ("Designs under 800 N", Table(HEADS, list(cells(rows))), [picture]),
        ("Active limits of the optima and their multipliers", prices(rows), []),
        ("Prototypes compared with the optima", Table(DISTANCE_HEADS, distance_cells(away)), []),
        ("Pareto fronts of opening time and holding energy", Table(HEADS, list(cells(fronts))), []),
        ("Products", (Table(products.HEADS, products.cells(bought)), str(choice)), []),
        ("Ratios", Table(STATEMENT_HEADS, _said(said)), []),
    ]
    write_report(out, "concepts", "The two concepts redesigned", parts, ABOUT)
