"""`python -m studies validate`."""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from acausal import displayed
from acausal.design import Scale

from .._output import ACTUATOR_NAMES, plain_table, print_table, progress, read_json, require_matplotlib, write_json
from ..actuators import parameter_set
from ._conflicts import CONFLICTS, NOT_COMPARED
from ._rows import ACTUATORS, TOLERANCE, Row, compare
from ._statements import GIVEN, KINDS, NOT_COMPARABLE, PREDICTED, REFITTED, statements
from ._words import NOTE, readable, spoken

STORED = Path(__file__).parent / "rows.json"
HEADS = ("quantity", "condition", "source in the thesis", "thesis", "model", "deviation", "kind", "note")
NO_LOAD_HEAD = "no-load set"
COUNT_HEADS = ("kind of figure", "figures", f"within {100.0 * TOLERANCE:g} %", "meaning")
SET_HEADS = ("parameter", "unit", *(ACTUATOR_NAMES[name] for name in ACTUATORS), "source")
CONFLICT_HEADS = ("item", "printed values", "value used")
NOT_COMPARED_HEADS = ("not compared", "reason")
MEANING: Mapping[str, str] = MappingProxyType(
    {
        GIVEN: "used to choose the parameters of the set, so they are no test",
        PREDICTED: "predicted by the model with the set",
        REFITTED: "parameters of the set, identified again from the measurements",
        NOT_COMPARABLE: "the thesis and the set describe different things; see the note",
    }
)


@dataclasses.dataclass(frozen=True)
class Missing:
    """A figure of the thesis that is not compared."""

    source: str
    reason: str


@dataclasses.dataclass(frozen=True)
class Count:
    """The number of figures of one kind, and how many of them the model reproduces within `TOLERANCE`."""

    kind: str
    figures: int
    reproduced: int


def main(json: Path | None = None, out: Path | None = None, rtol: float = 1e-9) -> list[Row]:
    """Compare, print, and write rows to the file `json`, and pictures and a report to the folder `out`."""
    if out is not None:
        require_matplotlib()
    wanted = [statement for actuator in ACTUATORS for statement in statements(actuator)]
    rows = [compare(statement, rtol) for statement in progress(wanted, "simulating")]
    for name, heads, cells in tables(rows):
        print_table(f"{name}: thesis and model", heads, cells)
    print(notes(rows))
    print_table("Reproduced figures by kind", COUNT_HEADS, count_cells(rows))
    if json is not None:
        write_json(json, rows, counts=counts(rows), not_compared=[Missing(*item) for item in NOT_COMPARED])
    if out is not None:
        from ._report import report

        report(rows, out, rtol)
    return rows


def tables(rows: Sequence[Row]) -> Iterable[tuple[str, tuple[str, ...], list[tuple[str, ...]]]]:
    """The name of each actuator, with heads and lines of its table; with a column for the no-load set if it has one."""
    reasons = _reasons(rows)
    for name in dict.fromkeys(row.actuator for row in rows):
        own = [row for row in rows if row.actuator == name]
        two = any(row.no_load is not None for row in own)
        heads = (*HEADS[:5], NO_LOAD_HEAD, *HEADS[5:]) if two else HEADS
        yield ACTUATOR_NAMES[name], heads, [_cells(row, reasons, two) for row in own]


def _cells(row: Row, reasons: list[str], two: bool) -> tuple[str, ...]:
    quantity = Scale.of(row.unit).headed(spoken(row.quantity))
    thesis, model, no_load = (_number(value, row.unit) for value in (row.thesis, row.model, row.no_load))
    deviation = "" if row.deviation is None else f"{100.0 * row.deviation:+z.2f} %"
    note = f"({reasons.index(row.reason) + 1})" if row.reason else ""
    part = "" if row.thesis is None else row.kind
    second = (no_load,) if two else ()
    return quantity, readable(row.condition), row.source, thesis, model, *second, deviation, part, note


def _number(value: float | None, unit: str) -> str:
    return "-" if value is None else f"{displayed(value, unit)[0]:.5g}"


def _reasons(rows: Sequence[Row]) -> list[str]:
    return list(dict.fromkeys(row.reason for row in rows if row.reason))


def notes(rows: Sequence[Row]) -> str:
    """The numbered notes of the tables."""
    return "\n".join([*(f"({number}) {reason}" for number, reason in enumerate(_reasons(rows), start=1)), NOTE])


def counts(rows: Sequence[Row]) -> list[Count]:
    """The number of figures by kind: given, predicted, refitted, not comparable."""
    return [
        Count(kind, len(own), sum(bool(row.reproduced) for row in own))
        for kind in KINDS
        for own in [[row for row in rows if row.thesis is not None and row.kind == kind]]
    ]


def count_cells(rows: Sequence[Row]) -> list[tuple[str, ...]]:
    """The cells of the counts as text."""
    return [(one.kind, str(one.figures), str(one.reproduced), MEANING[one.kind]) for one in counts(rows)]


def set_cells() -> list[tuple[str, ...]]:
    """The cells of the set of parameters as text, in display units, with the source of each value."""
    return [
        (
            one.name, one.unit, *(f"{one.values[name]:.5g}" if name in one.values else "-" for name in ACTUATORS),
            one.source,
        )
        for one in parameter_set(ACTUATORS)
    ]  # fmt: skip


def stored() -> list[Row]:
    """The rows shown in the documentation, written by `python -m studies validate --json`."""
    return read_json(STORED, rows=Row)["rows"]


def as_text(rows: Sequence[Row]) -> str:
    """A table for each actuator, with a line for each row, and the notes of the last column."""
    return "\n\n".join([*(f"{name}\n{plain_table(heads, cells)}" for name, heads, cells in tables(rows)), notes(rows)])


def counts_as_text(rows: Sequence[Row]) -> str:
    """The table of counts, with a line for each kind of figure."""
    return plain_table(COUNT_HEADS, count_cells(rows))


def set_as_text() -> str:
    """The table of parameters that all studies share, with the source of each value."""
    return plain_table(SET_HEADS, set_cells())


def conflicts_as_text() -> str:
    """The tables of contradictions and of figures that are not compared."""
    return f"{plain_table(CONFLICT_HEADS, CONFLICTS)}\n\n{plain_table(NOT_COMPARED_HEADS, NOT_COMPARED)}"
