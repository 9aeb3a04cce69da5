"""The table of a comparison."""

import collections
import datetime
import json
import re
import textwrap
from collections.abc import Iterable
from pathlib import Path

from .compare import Compared

FAILURES = ("front end", "translation", "run")


def library_of(model: str) -> str:
    """The sub-library of a model: `Electrical.Analog` for `Modelica.Electrical.Analog.Examples.Rectifier`.

    The library itself for a model that lies in none.
    """
    library, *inner = model.split(".")[:-1]
    parts = [part for part in inner if part != "Examples"] or [library]
    return ".".join(parts[:2]) if parts[0] in ("Electrical", "Magnetic", "Mechanics", "Thermal") else parts[0]


def written(rows: Iterable[Compared], about: str) -> str:
    """A page in Markdown: counts by sub-library, and each model with its time, and its largest deviation or why it
    fails.
    """
    rows = sorted(rows, key=lambda row: row.model)
    libraries: dict[str, list[Compared]] = collections.defaultdict(list)
    for row in rows:
        libraries[library_of(row.model)].append(row)
    lines = [f"{datetime.date.today():%d %B %Y}; {about}", ""]
    if rows:
        lines += [*_HEAD, *(_line(name, own) for name, own in sorted(libraries.items()))]
        lines += [_line("**all**", rows), "", "| Model | Result | Time in s | Reason |", "|---|---|---|---|"]
        lines += [f"| {row.model} | {row.stage} | {row.seconds:.0f} | {_reason(row)} |" for row in rows]
    return "\n".join(lines) + "\n"


_HEAD = [
    "| Library | Examples | Translated | Simulated | Compared | Agree | Gradient right |",
    "|---|---|---|---|---|---|---|",
]


def _line(name: str, rows: list[Compared]) -> str:
    translated = sum(row.stage not in ("front end", "translation") for row in rows)
    run = [row for row in rows if row.stage not in FAILURES]
    compared = sum(row.stage in ("differs", "agrees") for row in run)
    agree = sum(row.stage == "agrees" for row in run)
    checked = [row for row in rows if row.gradient.startswith(("right", "wrong"))]
    right = sum(row.gradient.startswith("right") for row in checked)
    return f"| {name} | {len(rows)} | {translated} | {len(run)} | {compared} | {agree} | {right} of {len(checked)} |"


def _reason(row: Compared) -> str:
    if row.stage in ("differs", "agrees") and row.deviations:
        worst = max(row.deviations, key=row.deviations.__getitem__)
        return f"{worst} by {row.deviations[worst]:.2g} of its range"
    reason = re.sub(r"/(?:[^/]*/)+(?=[^/]*\.mo\b)", "", " ".join(row.reason.split()))  # without the user's folders
    return textwrap.shorten(reason.replace("|", "\\|"), 200, placeholder=" …")


def save(row: Compared, file: Path) -> None:
    """Appends a row to a file of rows."""
    with file.open("a") as lines:
        lines.write(json.dumps(vars(row)) + "\n")


def saved(file: Path) -> dict[str, Compared]:
    """The rows in a file, by model."""
    if not file.exists():
        return {}
    rows = [Compared(**json.loads(line)) for line in file.read_text().splitlines()]
    return {row.model: row for row in rows}
