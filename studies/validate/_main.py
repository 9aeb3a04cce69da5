"""`python -m studies validate`."""

import dataclasses
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType

from acausal import BondGraph, bond_graph

from .._output import (
    ACTUATOR_NAMES,
    plain_table,
    print_table,
    progress,
    read_json,
    require_matplotlib,
    save,
    write_json,
)
from ..actuators import sila
from ._linear import CLUTCH_STIFFNESS, linear_actuator
from ._rows import ACTUATORS, Row, compare, run
from ._thesis import CHOSEN, DECIDED, GIVEN, NOT_COMPARED, NOTE, TOLERANCE, readable, spoken, statements

STORED = Path(__file__).parent / "rows.json"
HEADS = ("quantity", "condition", "source in the thesis", "thesis", "model", "deviation", "why")
ABOUT = """Meloni's thesis (Torino, 2012) states opening times, currents, frequencies and ratios of actuators that
open the clutch of a car: one in use, with a worm, and three new ones. Two of these push by motor, gearbox, cam and
master cylinder (EMA), one by motor and pump (EHS).

Each figure is set beside that of the model, all from one set of parameters, and where they differ it is told why.
"""
SHOWN: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "validate_deviations": (
            "How far the model is from each figure",
            "Figures within the grey band count as reproduced; the summary has the reasons of the others.",
        ),
        "validate": (
            "Times, currents and frequencies",
            "Diamonds are the model's, circles were measured, squares are computed or in a table of the thesis.",
        ),
        "validate_openings": (
            "The openings in time",
            "Stroke, current and pressure at full voltage, with the opening times that the thesis states.",
        ),
        "validate_bond_graph_whole": (
            "Its bond graph with supply and losses",
            "As in chapter 3: the liquid's damping takes the flow that compresses it, at a 1-junction of their own.",
        ),
        "validate_linear": (
            "The present actuator as a linear system",
            "Its gain over the frequency, and which store has which share of the energy of its two modes.",
        ),
    }
)


@dataclasses.dataclass(frozen=True)
class Missing:
    """What the thesis has and no figure of the model can be set beside."""

    source: str
    reason: str


def main(json: Path | None = None, out: Path | None = None, rtol: float = 1e-9) -> list[Row]:
    """Compare, print, and write rows to the file `json`, and pictures and a report to the folder `out`."""
    if out is not None:
        require_matplotlib()
    wanted = [statement for actuator in ACTUATORS for statement in statements(actuator)]
    rows = [compare(statement, rtol) for statement in progress(wanted, "simulating")]
    for name, cells in _by_actuator(rows):
        print_table(f"{name}: thesis and model", HEADS, cells)
    print(summary(rows))
    if json is not None:
        write_json(json, rows, not_compared=[Missing(*item) for item in NOT_COMPARED])
    if out is not None:
        _draw(rows, out, rtol)
    return rows


def _by_actuator(rows: list[Row]) -> Iterable[tuple[str, list[tuple[str, ...]]]]:
    """The names of the actuators, and the lines of each."""
    reasons = _reasons(rows)
    for name in dict.fromkeys(row.actuator for row in rows):
        yield ACTUATOR_NAMES[name], list(_cells([row for row in rows if row.actuator == name], reasons))


def _cells(rows: list[Row], reasons: list[str]) -> Iterable[tuple[str, ...]]:
    for row in rows:
        thesis = "-" if row.thesis is None else f"{row.thesis:.6g}"
        deviation = "" if row.deviation is None else f"{100.0 * row.deviation:+z.2f} %"
        quantity = spoken(row.quantity) + ("" if row.unit == "1" else f" [{row.unit}]")
        why = f"({reasons.index(row.reason) + 1})" if row.reason else ""
        yield quantity, readable(row.condition), row.source, thesis, f"{row.model:.6g}", deviation, why


def _reasons(rows: list[Row]) -> list[str]:
    return list(dict.fromkeys(row.reason for row in rows if row.reason))


def summary(rows: list[Row]) -> str:
    """How many figures are reproduced, why others are not, and what is not compared."""
    stated = [row for row in rows if row.reproduced is not None]
    within = [row for row in stated if row.reproduced]
    used = sum(row.reason in (GIVEN, CHOSEN) for row in within)
    lines = [
        f"{len(within)} of {len(stated)} figures of the thesis are reproduced within {TOLERANCE:.0%}, by one set; "
        f"{used} of these {len(within)} went into the set."
    ]
    lines += [f"({number}) {reason}" for number, reason in enumerate(_reasons(rows), start=1)]
    lines += [f"Not compared: {source}: {reason}." for source, reason in NOT_COMPARED]
    return "\n".join([*lines, NOTE])


def decided() -> str:
    """What the thesis leaves open of the set of parameters, and what decided it."""
    return "\n".join(f"- {what}: {by}" for what, by in DECIDED)


def stored() -> list[Row]:
    """The rows as they were when the documentation was written: `python -m studies validate --json` gives them."""
    return read_json(STORED, rows=Row)["rows"]


def as_text(rows: list[Row]) -> str:
    """A table for each actuator, with a line for each row; numbers in brackets are the reasons of `summary`."""
    return "\n\n".join(f"{name}\n{plain_table(HEADS, cells)}" for name, cells in _by_actuator(rows))


def _draw(rows: list[Row], out: Path, rtol: float) -> None:
    from .._report import Table, write_report
    from ._plot import plot_comparison, plot_deviations, plot_linear, plot_openings

    runs = {actuator: run(actuator, rtol=rtol) for actuator in ACTUATORS}
    graph = bond_graph(linear_actuator())
    whole = bond_graph(sila(spring_rate=CLUTCH_STIFFNESS))
    pictures = {
        "validate_deviations": plot_deviations(rows),
        "validate": plot_comparison(rows),
        "validate_openings": plot_openings(runs, rows),
        "validate_linear": plot_linear(rows),
        "validate_bond_graph": graph.plot().figure,
        "validate_bond_graph_whole": whole.plot().figure,
    }
    for name, figure in pictures.items():
        save(figure, out, name)
    texts = {**SHOWN, "validate_bond_graph": ("The present actuator, read off its bond graph", _of_graph(graph))}
    parts = [(*texts[name], [figure]) for name, figure in pictures.items()]
    summed = ("Summary", summary(rows), [])
    tables = [
        ("All figures", [Table(HEADS, cells, name) for name, cells in _by_actuator(rows)], []),
        ("What the thesis leaves open of the set", Table(("parameter", "decided by"), DECIDED), []),
    ]
    title = "Clutch actuators: Meloni's thesis (2012) and the model"
    write_report(out, "validate", title, [summed, *parts, *tables], ABOUT)


def _of_graph(graph: BondGraph) -> str:
    """Bonds, frequencies and shares of energy."""
    frequencies = abs(graph.poles[::2]) / (2.0 * math.pi)
    heads = ("store", *(f"{frequency:.6g} Hz" for frequency in frequencies))
    shares = ((name, *(f"{share:.6g}" for share in values[::2])) for name, values in graph.energy.items())
    return f"{graph}\n\n{plain_table(heads, shares)}"
