"""`python -m studies concepts`."""

from collections.abc import Sequence
from pathlib import Path

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

ABOUT = """Two ways to open the clutch of a car, as in Meloni's thesis (Torino, 2012): by motor, gearbox, cam and
master cylinder (EMA), and by motor and pump (EHS), where either the motor holds the clutch open, or a valve.

All that the thesis fixed by hand is free: ratio or displacement, bores, cam, supply and motor. Its targets are kept:
open within 200 ms, the EHS within 100 ms, motors below 250 W, 800 N at the slave. Limits of currents, pressure, speed
and cam are those that its parts have, or usual ones.
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
    print(f"What holds the optima, and what one unit more buys\n{prices(rows)}\n")
    print_table("How far the prototypes were from the best of their kind", DISTANCE_HEADS, distance_cells(away))
    print_table("Fronts of opening time and energy of a hold, within the target of 200 ms", HEADS, cells(fronts))
    print_table("Products, none worse in time, energy and mass", products.HEADS, products.cells(bought))
    print(f"{choice}\n")
    print_table("Ratios", STATEMENT_HEADS, _said(said))
    if json is not None:
        write_json(json, rows, distances=away, fronts=fronts, products=bought, statements=said)
    if out is not None:
        _report(rows, away, fronts, bought, choice, said, out)
    return rows


def study(rtol: float = 1e-9) -> list[Row]:
    """The prototypes, and the optimum of each concept with each motor that is allowed, the fastest first."""
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
    from .._report import Table, write_report
    from ._plot import plot_designs

    picture = plot_designs(rows, fronts, bought)
    save(picture, out, "concepts")
    parts = [
        ("Designs under 800 N", Table(HEADS, list(cells(rows))), [picture]),
        ("What holds the optima, and what one unit more buys", prices(rows), []),
        ("How far the prototypes were", Table(DISTANCE_HEADS, distance_cells(away)), []),
        ("Fronts of opening time and energy of a hold", Table(HEADS, list(cells(fronts))), []),
        ("Products", (Table(products.HEADS, products.cells(bought)), str(choice)), []),
        ("Ratios", Table(STATEMENT_HEADS, _said(said)), []),
    ]
    write_report(out, "concepts", "The two concepts designed anew", parts, ABOUT)
