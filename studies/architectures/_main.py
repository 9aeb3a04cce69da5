"""`python -m studies architectures`."""

import concurrent.futures
import multiprocessing
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from acausal import Table

from .. import validate
from .._compile import compiled_quickly
from .._output import ACTUATOR_NAMES, plain_table, print_table, progress, read_json, require_matplotlib, write_json
from ._architecture import Architecture
from ._conditions import CONDITIONS, NO_LOAD
from ._families import ARCHITECTURES
from ._parts import ASSUMED
from ._rows import Row, row_of
from ._words import HEADS as LIMIT_HEADS
from ._words import SIZES, elasticities, limits

HEADS = (
    "architecture", "opening [ms]", f"{NO_LOAD} [ms]", "peak [A]", "motor, held [A]", "battery, held [A]",
    "power, held [W]", "energy [J]", "opening [J]", "mass [kg]", "imbalance",
)  # fmt: skip
MEASURED_HEADS = ("prototype", "measured [ms]", "set of all studies [ms]", "no-load set [ms]", "source")
SHARE_HEADS = ("architecture", "size", "in the model", "opening time [% per %]")
OTHER_HEADS = ("architecture", "40 C", *CONDITIONS)
OTHER: Mapping[str, tuple[str, float, str]] = MappingProxyType(
    {
        "Opening time [ms]": ("opening_time", 1e3, "z.1f"),
        "Power of the hold [W]": ("holding_power", 1.0, "z.1f"),
        "Battery current of the hold [A]": ("battery_current", 1.0, "z.2f"),
        "Energy of the duty [J]": ("energy", 1.0, "z.0f"),
    }
)  # attribute of a row, its factor and format, by title
ABOUT = """Actuators that open the clutch of a car, with equal sizes and on one duty: open in minimum time, hold for
10 s, close along a profile of 1 s. The clutch has a stroke of 12 mm and 58 N/mm; the supply has 13.5 V.

"peak" is the motor current during the opening, and "motor, held" the motor current at the end of the hold. Battery
current and power are means over the hold, with a lossless converter. Energies are supplied by the battery; the
imbalance of the energy account is relative to the supplied energy. The friction of all drives is that of the set of
all studies, which was fitted to openings. The no-load set of drives with a pump has the friction of the thesis' test
without load, in chapter 8."""
MEASURED = """The thesis measured two of these. Its RE50 opened sooner than the resistance of Table 8.2 allows. Its
actuator with pump and valve did not move for 30 ms; the study of the prototypes discusses possible causes."""
AREAS = """The whole area is the power of the pump, accumulator or master cylinder. Its parts are the power to the
clutch, the loss in the valve, and the surplus flow."""
RTOL = 1e-8  # at least, of the runs; the energy accounts then close far better than to 1e-6
STORED = Path(__file__).parent / "rows.json"
WORKERS = 2  # processes; each compiles its own programs
LONGEST = "automated gearbox"  # slowest to simulate by far; started first, so that no process waits for it at the end


def main(json: Path | None = None, out: Path | None = None, rtol: float = RTOL) -> list[Row]:
    """Simulate all architectures, print the table, write rows to the file `json` and a report to the folder `out`."""
    if out is not None:
        require_matplotlib()
    rows = study(max(rtol, RTOL))
    print_table("Clutch actuators: one duty for all", HEADS, cells(rows))
    print_table("Measured opening times, and those of `validate`", MEASURED_HEADS, measured_cells())
    print_table("Limits of the opening time", LIMIT_HEADS, limit_cells(rows))
    for title in OTHER:
        print_table(f"{title}, no-load set, cold, hot, and with a worn clutch", OTHER_HEADS, _other_cells(rows, title))
    if json is not None:
        write_json(json, rows)
    if out is not None:
        report(rows, out)
    return rows


def study(rtol: float = RTOL, names: Sequence[str] | None = None) -> list[Row]:
    """The rows of all architectures, or of those with the given names, computed in parallel processes."""
    chosen = [item.name for item in ARCHITECTURES if names is None or item.name in names]
    context = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(min(WORKERS, len(chosen)), context) as pool:
        runs = {name: pool.submit(_row, name, rtol) for name in sorted(chosen, key=lambda name: name != LONGEST)}
        return [runs[name].result() for name in progress(chosen, "comparing")]


def _row(name: str, rtol: float) -> Row:
    with compiled_quickly():
        return row_of(named(name), rtol)


def named(name: str) -> Architecture:
    """The architecture with a name."""
    return next(item for item in ARCHITECTURES if item.name == name)


def cells(rows: Iterable[Row]) -> Iterable[tuple[str, ...]]:
    """The table cells as text."""
    for row in rows:
        yield (
            row.architecture, f"{1e3 * row.opening_time:.1f}", _under(row, NO_LOAD, "opening_time", 1e3, ".1f"),
            f"{row.peak_current:z.1f}", f"{row.motor_current:z.2f}", f"{row.battery_current:z.2f}",
            f"{row.holding_power:z.1f}",
            f"{row.energy:.0f}", f"{row.energies['opening']:.1f}", f"{row.mass:.2f}", f"{row.imbalance:.0e}",
        )  # fmt: skip


def measured_cells() -> list[tuple[str, ...]]:
    """Measured opening times of two prototypes, and those of `validate` with either set."""
    return [
        (
            ACTUATOR_NAMES[row.actuator], f"{1e3 * (row.thesis or 0.0):.0f}", f"{1e3 * row.model:.1f}",
            "-" if row.no_load is None else f"{1e3 * row.no_load:.1f}", row.source,
        )
        for row in validate.stored()
        if row.actuator in ("ema_maxon", "ehs_maxon") and (row.quantity, row.condition) == ("opening_time", "base")
        and "measured" in row.source
    ]  # fmt: skip


def limit_cells(rows: Iterable[Row]) -> list[tuple[str, ...]]:
    """The cells of the table of limits as text."""
    return [limits(row, named(row.architecture).build()) for row in rows]


def _other_cells(rows: Iterable[Row], title: str) -> Iterable[tuple[str, ...]]:
    """The cells of a figure under all conditions."""
    name, factor, form = OTHER[title]
    for row in rows:
        others = [_under(row, condition, name, factor, form) for condition in CONDITIONS]
        yield row.architecture, format(factor * getattr(row, name), form), *others


def _under(row: Row, condition: str, name: str, factor: float, form: str) -> str:
    """A figure under a condition; a dash if the architecture lacks it, or if the run failed earlier."""
    value = row.conditions.get(condition, {}).get(name)
    return "-" if value is None else format(factor * value, form)


def report(rows: Sequence[Row], out: Path) -> None:
    """Writes the pictures of all architectures, and one page with them."""
    from .._output import save
    from .._report import write_report
    from ._plot import plot_areas, plot_energies, plot_figures

    titles = {item.name: item.title for item in ARCHITECTURES}
    figures, areas, energies = (plot(rows, titles) for plot in (plot_figures, plot_areas, plot_energies))
    save(figures, out, "architectures_figures")
    save(areas, out, "architectures_areas")
    save(energies, out, "architectures_energy")
    others = [Table(OTHER_HEADS, list(_other_cells(rows, title)), title) for title in OTHER]
    shares = [
        (row.architecture, SIZES[path], path, f"{share:+.2f}")
        for row in rows
        for path, share in elasticities(row, named(row.architecture).build()).items()
    ]
    parts = [
        (
            "Opening, hold and whole duty",
            [
                Table(HEADS, list(cells(rows))),
                Table(MEASURED_HEADS, measured_cells(), "Measured opening times"),
                MEASURED,
            ],
            [],
        ),
        ("Limits of the opening time", Table(LIMIT_HEADS, limit_cells(rows)), []),
        ("Sensitivities of the opening time", Table(SHARE_HEADS, shares), []),
        ("No-load set, cold, hot, and with a worn clutch", others, []),
        ("Opening, hold and energy", "", [figures]),
        ("Energy of one operation", "", [energies]),
        ("Pressure over flow", AREAS, [areas]),
        ("Masses", Table(("architecture", "published", "not published"), list(map(_masses, ARCHITECTURES))), []),
        ("Assumptions", Table(("assumption", "reason"), list(ASSUMED.items())), []),
    ]
    write_report(out, "architectures", "Architectures of clutch actuators", parts, ABOUT)


def stored() -> list[Row]:
    """The rows shown in the documentation, written by `python -m studies architectures --json`."""
    return read_json(STORED, rows=Row)["rows"]


def as_text(rows: Sequence[Row]) -> str:
    """The table with a line for each row."""
    return plain_table(HEADS, cells(rows))


def measured_as_text() -> str:
    """The table of the measured prototypes and `validate`, with a line for each."""
    return plain_table(MEASURED_HEADS, measured_cells())


def limits_as_text(rows: Sequence[Row]) -> str:
    """The table of limits, with a line for each row."""
    return plain_table(LIMIT_HEADS, limit_cells(rows))


def conditions_as_text(rows: Sequence[Row]) -> str:
    """The tables of the other conditions, with a line for each row."""
    return "\n\n".join(f"{title}\n{plain_table(OTHER_HEADS, list(_other_cells(rows, title)))}" for title in OTHER)


def _masses(item: Architecture) -> tuple[str, str, str]:
    return item.name, ", ".join(f"{part} {mass:g} kg" for part, mass in item.masses.items()), item.weightless
