"""`python -m studies validate`."""

from collections.abc import Iterable
from pathlib import Path

from .._output import ACTUATOR_NAMES, print_table, progress, require_matplotlib, save, write_json
from ._rows import ACTUATORS, Row, compare, run
from ._thesis import NOTES, statements

HEADS = ("actuator", "quantity", "condition", "source in the thesis", "unit", "thesis", "model", "deviation")


def main(json: Path | None = None, out: Path | None = None, rtol: float = 1e-9) -> list[Row]:
    """Compare, print, and write rows to the file `json` and pictures to the folder `out`."""
    if out is not None:
        require_matplotlib()
    wanted = [statement for actuator in ACTUATORS for statement in statements(actuator)]
    rows = [compare(statement, rtol) for statement in progress(wanted, "simulating")]
    print_table("Thesis and model", HEADS, _cells(rows))
    print(*NOTES, sep="\n")
    if json is not None:
        write_json(json, rows)
    if out is not None:
        _draw(rows, out, rtol)
    return rows


def _cells(rows: list[Row]) -> Iterable[tuple[str, ...]]:
    for row in rows:
        thesis = "-" if row.thesis is None else f"{row.thesis:.4g}"
        deviation = "" if row.deviation is None else f"{100.0 * row.deviation:+.1f} %"
        name, quantity = ACTUATOR_NAMES[row.actuator], row.quantity.replace("_", " ")
        yield name, quantity, row.condition, row.source, row.unit, thesis, f"{row.model:.4g}", deviation


def _draw(rows: list[Row], out: Path, rtol: float) -> None:
    from ._plot import plot_comparison, plot_openings

    save(plot_comparison(rows), out, "validate")
    save(plot_openings({actuator: run(actuator, rtol=rtol) for actuator in ACTUATORS}, rows), out, "validate_openings")
