"""`python -m studies architectures`."""

import concurrent.futures
import multiprocessing
from collections.abc import Iterable, Sequence
from pathlib import Path

from .._compile import compiled_quickly
from .._output import plain_table, print_table, progress, read_json, require_matplotlib, write_json
from ._architecture import Architecture
from ._conditions import CONDITIONS
from ._families import ARCHITECTURES
from ._parts import ASSUMED
from ._rows import Row, row_of

HEADS = (
    "architecture", "opening [ms]", "peak [A]", "holding [A]", "holding [W]", "energy [J]", "opening [J]", "mass [kg]",
    "imbalance",
)  # fmt: skip
OTHER_HEADS = ("architecture", *(f"{what}, {when}" for what in ("opening [ms]", "holding [W]", "energy [J]")
                                 for when in ("40 C", *CONDITIONS)))  # fmt: skip
RTOL = 1e-8  # at least, of the runs: the accounts are then balanced far better than to 1e-6
STORED = Path(__file__).parent / "rows.json"
WORKERS = 2  # processes; each compiles programs of its own


def main(json: Path | None = None, out: Path | None = None, rtol: float = RTOL) -> list[Row]:
    """Simulate all architectures, print the table, write rows to the file `json` and a report to the folder `out`."""
    if out is not None:
        require_matplotlib()
    rows = study(max(rtol, RTOL))
    print_table("Clutch actuators: one duty for all", HEADS, cells(rows))
    print_table("Cold, hot, and with a worn clutch", OTHER_HEADS, _other_cells(rows))
    if json is not None:
        write_json(json, rows)
    if out is not None:
        report(rows, out)
    return rows


def study(rtol: float = RTOL, names: Sequence[str] | None = None) -> list[Row]:
    """The rows of all architectures, or of those with the given names, in processes side by side."""
    chosen = [item for item in ARCHITECTURES if names is None or item.name in names]
    context = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(min(WORKERS, len(chosen)), context) as pool:
        runs = [pool.submit(_row, item.name, rtol) for item in chosen]
        return [run.result() for run in progress(runs, "comparing")]


def _row(name: str, rtol: float) -> Row:
    with compiled_quickly():
        return row_of(next(item for item in ARCHITECTURES if item.name == name), rtol)


def cells(rows: Iterable[Row]) -> Iterable[tuple[str, ...]]:
    """The table as texts."""
    for row in rows:
        yield (
            row.architecture, f"{1e3 * row.opening_time:.1f}", f"{row.peak_current:z.1f}",
            f"{row.holding_current:z.2f}", f"{row.holding_power:z.1f}", f"{row.energy:.0f}",
            f"{row.energies['opening']:.1f}", f"{row.mass:.2f}", f"{row.imbalance:.0e}",
        )  # fmt: skip


def _other_cells(rows: Iterable[Row]) -> Iterable[tuple[str, ...]]:
    """Opening time, power of the hold and energy under all conditions."""
    for row in rows:
        base = {"opening_time": row.opening_time, "holding_power": row.holding_power, "energy": row.energy}
        sets = [base, *(row.conditions[name] for name in CONDITIONS)]
        yield (
            row.architecture,
            *(f"{1e3 * one['opening_time']:.1f}" for one in sets),
            *(f"{one['holding_power']:z.1f}" if "holding_power" in one else "-" for one in sets),
            *(f"{one['energy']:.0f}" if "energy" in one else "-" for one in sets),
        )


def report(rows: Sequence[Row], out: Path) -> None:
    """Pictures of all architectures, and one page with them."""
    from .._output import save
    from .._report import write_report
    from ._plot import plot_areas, plot_energies

    titles = {item.name: item.title for item in ARCHITECTURES}
    areas, energies = plot_areas(rows, titles), plot_energies(rows, titles)
    save(areas, out, "architectures_areas")
    save(energies, out, "architectures_energy")
    parts = [
        ("Table", as_text(rows), [energies]),
        ("Pressure over flow", "Outer area: what pump or master cylinder give.", [areas]),
        ("Cold, hot, and with a worn clutch", conditions_as_text(rows), []),
        ("What limits each", "\n".join(f"{row.architecture}: {row.limit}" for row in rows), []),
        ("Masses", "\n".join(map(_mass, ARCHITECTURES)), []),
        ("Assumed", "\n".join(f"{what}: {reason}" for what, reason in ASSUMED.items()), []),
    ]
    write_report(out, "architectures", "Architectures of clutch actuators", parts)


def stored() -> list[Row]:
    """The rows as they were when the documentation was written: `python -m studies architectures --json` gives them."""
    return read_json(STORED, rows=Row)["rows"]


def as_text(rows: Sequence[Row]) -> str:
    """The table with a line for each row."""
    return plain_table(HEADS, cells(rows))


def conditions_as_text(rows: Sequence[Row]) -> str:
    """The duty under other conditions, a line for each row."""
    return plain_table(OTHER_HEADS, _other_cells(rows))


def _mass(item: Architecture) -> str:
    known = ", ".join(f"{part} {mass:g} kg" for part, mass in item.masses.items())
    return f"{item.name}: {known}; no mass is published of: {item.weightless}"
