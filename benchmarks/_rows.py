"""The report of a benchmark, as a table and as JSON."""

import dataclasses
import datetime
import importlib.metadata
import json
import os
import platform
import re
from collections.abc import Sequence
from pathlib import Path


@dataclasses.dataclass(frozen=True)
class Row:
    """One measurement: `value` in `unit`, which is `ratio` times what it is measured `against`; less is better.

    `limit` is the largest ratio that is good enough, None for a row that only informs.
    """

    name: str
    value: float
    unit: str
    against: str
    ratio: float | None
    limit: float | None = None

    @property
    def verdict(self) -> str:
        if self.limit is None or self.ratio is None:
            return ""
        return "met" if self.ratio <= self.limit else "missed"


def compared(name: str, value: float, unit: str, reference: float, against: str, limit: float | None = None) -> Row:
    """A measurement beside a reference in the same unit."""
    return Row(name, value, unit, f"{against}: {reference:.4g} {unit}", value / reference, limit)


def write(rows: Sequence[Row], path: Path) -> None:
    """Save as JSON with date, machine and versions, without the limits: what is good enough is not a measurement."""
    fields = ("name", "value", "unit", "against", "ratio")
    found = {
        "date": datetime.date.today().isoformat(),
        "machine": f"{_processor()}, {os.cpu_count()} cores",
        "versions": {"python": platform.python_version(), "jax": importlib.metadata.version("jax")},
        "rows": [{f: getattr(row, f) for f in fields} for row in rows],
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(found, indent=1) + "\n")


def _processor() -> str:
    """Its name; Linux has it in a file, where `platform` does not look."""
    info = Path("/proc/cpuinfo")
    named = re.search(r"model name\s*: (.*)", info.read_text()) if info.exists() else None
    return named[1] if named else platform.processor()


def show(rows: Sequence[Row]) -> None:
    """Print as a table, with rich where it is installed."""
    heads = ("benchmark", "value", "unit", "against", "ratio", "at most", "")
    cells = [
        (row.name, f"{row.value:.4g}", row.unit, row.against, _number(row.ratio), _number(row.limit), row.verdict)
        for row in rows
    ]
    try:
        from rich.console import Console
        from rich.table import Table
    except ImportError:
        widths = [max(len(line[i]) for line in [heads, *cells]) for i in range(len(heads))]
        for line in [heads, *cells]:
            print("  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip())
        return
    table = Table()
    for head in heads:
        # In a narrow terminal words take more lines, and numbers stay whole.
        table.add_column(
            head,
            justify="right" if head in ("value", "ratio", "at most") else "left",
            no_wrap=head not in ("benchmark", "against"),
        )
    for line in cells:
        table.add_row(*line, style="red" if line[-1] == "missed" else None)
    Console(width=None if Console().is_terminal else 160).print(table)


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"
