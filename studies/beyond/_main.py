"""`python -m studies beyond`."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from acausal import Table

from .._output import print_table, progress, require_matplotlib, write_json
from . import _line, _load, _passages, _profiles, _series, _temperature
from ._row import HEADS, Row, cells

ABOUT = """Effects on the three clutch actuators of Meloni's thesis (Torino, 2012) that the thesis did not compute: a
real clutch, the line, temperature, the passages of the housing, a soft landing and series production. Two actuators
have motor, gearbox, cam and master cylinder (EMA), one has motor and pump (EHS). Statements of the thesis are shown for
comparison.
"""
RTOL = 1e-8  # at least, of all runs
ITEMS: Mapping[str, tuple[str, Callable[[float], list[Row]]]] = {
    _load.ITEM: ("A real clutch instead of the spring of the test rig", _load.rows),
    _line.ITEM: ("Inertia of the liquid and length of the line", lambda rtol: _line.rows(max(rtol, 1e-6))),
    _temperature.ITEM: ("Temperature, and operations per minute", _temperature.rows),
    _passages.ITEM: ("Drilled passages of the housing", lambda rtol: _passages.rows()),
    _profiles.ITEM: ("Fastest soft landing", _profiles.rows),
    _series.ITEM: ("Series production", _series.rows),
}


def main(json: Path | None = None, out: Path | None = None, rtol: float = RTOL) -> list[Row]:
    """Compute, print, and write rows to the file `json`, pictures and a report to the folder `out`."""
    if out is not None:
        require_matplotlib()
    rows = []
    for name in progress(list(ITEMS), "going on"):
        title, compute = ITEMS[name]
        found = compute(max(rtol, RTOL))
        print_table(title, HEADS, cells(found))
        rows += found
    if json is not None:
        write_json(json, rows)
    if out is not None:
        _report(rows, out)
    return rows


def _report(rows: Sequence[Row], out: Path) -> None:
    from .._output import save
    from .._report import write_report
    from ._plot import PICTURES

    parts = []
    for name, (title, _) in ITEMS.items():
        own = [row for row in rows if row.item == name]
        figure = PICTURES[name](own)
        save(figure, out, f"beyond_{name.replace(' ', '_')}")
        parts.append((title, Table(HEADS, cells(own)), [figure]))
    write_report(out, "beyond", "Beyond the thesis", parts, ABOUT)
