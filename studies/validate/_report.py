"""Plots and report of the comparison."""

import math
from collections.abc import Sequence
from pathlib import Path

from acausal import BondGraph, Table, bond_graph

from .._output import DOMAIN_COLORS, plain_table, save
from .._report import write_report
from ..actuators import sila
from . import _main as tables
from ._conflicts import CONFLICTS, NOT_COMPARED
from ._linear import CLUTCH_STIFFNESS, linear_actuator
from ._plot import plot_comparison, plot_deviations, plot_linear, plot_openings
from ._rows import ACTUATORS, Row, run

ABOUT = """Meloni's thesis (Torino, 2012) states opening times, currents, frequencies and ratios of actuators that
open the clutch of a car: one in use, with a worm, and three new ones. Two of these have motor, gearbox, cam and master
cylinder (EMA), one has motor and pump (EHS).

Each figure is compared with that of the model, with one set of parameters. Unless stated otherwise, conditions are
those of the base: 13.5 V, 58 N/mm and 12 mm. The no-load set has the friction of the thesis' test without load.
"""


def report(rows: Sequence[Row], out: Path, rtol: float) -> None:
    """Draw the pictures and write the report to the folder `out`."""
    runs = {actuator: run(actuator, rtol=rtol) for actuator in ACTUATORS}
    graph, whole = bond_graph(linear_actuator()), bond_graph(sila(spring_rate=CLUTCH_STIFFNESS))
    pictures = {
        "validate_deviations": plot_deviations(rows),
        "validate": plot_comparison(rows),
        "validate_openings": plot_openings(runs, rows),
        "validate_linear": plot_linear(rows),
        "validate_bond_graph": graph.plot(colours=DOMAIN_COLORS).figure,
        "validate_bond_graph_whole": whole.plot(colours=DOMAIN_COLORS).figure,
    }
    for name, figure in pictures.items():
        save(figure, out, name)
    beside = [Table(heads, cells, name) for name, heads, cells in tables.tables(rows)]
    parts = [
        ("Thesis and model", [Table(tables.COUNT_HEADS, tables.count_cells(rows)), *beside, tables.notes(rows)], []),
        ("Deviation of the model from each figure", "", [pictures["validate_deviations"]]),
        ("Times, currents and frequencies", "", [pictures["validate"]]),
        ("Openings over time", "", [pictures["validate_openings"]]),
        ("The present actuator as a linear system", "", [pictures["validate_linear"]]),
        ("Its bond graph", _of_graph(graph), [pictures["validate_bond_graph"]]),
        ("Its bond graph with supply and losses", "", [pictures["validate_bond_graph_whole"]]),
        ("The set of parameters", Table(tables.SET_HEADS, tables.set_cells()), []),
        ("Contradictions in the thesis", Table(tables.CONFLICT_HEADS, CONFLICTS), []),
        ("Not compared", Table(tables.NOT_COMPARED_HEADS, NOT_COMPARED), []),
    ]
    write_report(out, "validate", "Clutch actuators: Meloni's thesis (2012) and the model", parts, ABOUT)


def _of_graph(graph: BondGraph) -> str:
    """The bonds, frequencies and energy shares as text."""
    frequencies = abs(graph.poles[::2]) / (2.0 * math.pi)
    heads = ("store", *(f"{frequency:.6g} Hz" for frequency in frequencies))
    shares = ((name, *(f"{share:.6g}" for share in values[::2])) for name, values in graph.energy.items())
    return f"{graph}\n\n{plain_table(heads, shares)}"
