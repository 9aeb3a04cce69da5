"""Output of the studies: tables, progress, JSON and pictures."""

import dataclasses
import functools as ft
import hashlib
import importlib.util
import io
import json
import math
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

import acausal
import components
from acausal.design import Design

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Console

_T = TypeVar("_T")
UNFINISHED = "unfinished"  # folder with the stored results of an interrupted study
ACTUATOR_NAMES: Mapping[str, str] = MappingProxyType(
    {
        "sila": "present (worm 38:1)",
        "ema_fise": "EMA, FISE motor",
        "ema_maxon": "EMA, Maxon RE50",
        "ehs_maxon": "EHS, Maxon RE40",
        "motor_held": "EHS, held by its motor",
        "valve_held": "EHS, held by a valve",
    }
)
COLORS: Mapping[str, str] = MappingProxyType(
    {
        "sila": "#7a7a7a",
        "ema_fise": "#0072b2",
        "ema_maxon": "#d55e00",
        "ehs_maxon": "#009e73",
        "motor_held": "#0072b2",
        "valve_held": "#d55e00",
    }
)

DOMAIN_COLORS: Mapping[str, str] = MappingProxyType(
    {"electrical": "#cc79a7", "rotational": "#009e73", "translational": "#d55e00", "hydraulic": "#0072b2"}
)  # of bond graphs


def progress(items: Sequence[_T], what: str) -> Iterator[_T]:
    """Iterate over the items with a progress display on the terminal."""
    try:
        from rich.console import Console
        from rich.progress import track
    except ImportError:
        for number, item in enumerate(items, start=1):
            print(f"{what}: {number} of {len(items)}", file=sys.stderr)
            yield item
    else:
        yield from track(items, what, console=Console(stderr=True), transient=True)


def resumed(out: Path | None, name: str, make: Callable[[], _T]) -> _T:
    """The stored result of an interrupted run of the same code; otherwise the result of `make`, which is stored.

    `finished` removes the stored results.
    """
    if out is None:
        return make()
    path = out / UNFINISHED / f"{name}_{_digest_of_code()}.acausal"
    if path.exists():
        return acausal.load(path)
    made = make()
    path.parent.mkdir(parents=True, exist_ok=True)
    acausal.save(path.with_suffix(".part"), made)
    path.with_suffix(".part").rename(path)  # an interrupt leaves no incomplete file
    return made


def _digest_of_code() -> str:
    """Digest of the source code of the studies, the engine and the components."""
    folders = [Path(package.__file__ or "").parent for package in (acausal, components)] + [Path(__file__).parent]
    digest = hashlib.sha256()
    for folder in folders:
        for path in sorted([*folder.rglob("*.py"), *folder.rglob("*.csv")]):
            digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()[:16]


def finished(out: Path | None) -> None:
    """Remove the stored results of an interrupted run."""
    if out is not None:
        shutil.rmtree(out / UNFINISHED, ignore_errors=True)


def print_table(title: str, heads: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table: with rich on a terminal, if it is installed, otherwise in aligned columns."""
    console = _terminal()
    if console is None:
        print(f"{title}\n{plain_table(heads, rows)}\n")
        return
    from rich.markup import escape
    from rich.table import Table

    # Brackets are units, not markup.
    table = Table(title=escape(title), title_justify="left")
    for head in heads:
        table.add_column(escape(head), overflow="fold")
    for row in rows:
        table.add_row(*map(escape, row))
    console.print(table)


def _terminal() -> "Console | None":
    """The terminal; None if the output goes to a file, or without rich."""
    try:
        from rich.console import Console
    except ImportError:
        return None
    console = Console()
    return console if console.is_terminal else None


def prices_of(design: Design[Any]) -> str:
    """The active limits and bounds of a design with their multipliers."""
    unit = design.objective_scale.unit
    return ", ".join(
        f"{active.name} ({design.price(active):.3g} {unit} per {active.scale.unit})" for active in design.active
    )


def plain_table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in aligned columns."""
    lines = [heads, *rows]
    widths = [max(len(line[i]) for line in lines) for i in range(len(heads))]
    padded = ["  ".join(text.ljust(width) for text, width in zip(line, widths, strict=True)) for line in lines]
    return "\n".join(line.rstrip() for line in padded)


def write_json(path: Path, rows: Iterable[Any], **others: Iterable[Any]) -> None:
    """Write dataclass instances as `{"rows": [...]}`, and `others` likewise by their names.

    Numbers that are not finite become null, because JSON has no infinity.
    """
    tables = {name: [_plain(row) for row in table] for name, table in {"rows": rows, **others}.items()}
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(tables, indent=2, allow_nan=False) + "\n")


def read_json(path: Path, **kinds: Callable[..., _T]) -> dict[str, list[_T]]:
    """Read the tables of `write_json`, each as instances of its dataclass."""
    tables = json.loads(path.read_text())
    return {name: [kind(**row) for row in tables[name]] for name, kind in kinds.items()}


def _plain(row: Any) -> dict[str, Any]:
    items = dataclasses.asdict(row).items()
    return {name: None if isinstance(value, float) and not math.isfinite(value) else value for name, value in items}


def require_matplotlib() -> None:
    """Exit with an instruction if matplotlib is not installed."""
    if importlib.util.find_spec("matplotlib") is None:
        raise SystemExit('Pictures require matplotlib: pip install "acausal[plots]", or omit --out.')


def legend(figure: "Figure", columns: int, *, above: bool = False) -> None:
    """One legend below or above all panels, each entry once."""
    entries = {
        label: handle for panel in figure.axes for handle, label in zip(*panel.get_legend_handles_labels(), strict=True)
    }
    place = "outside upper center" if above else "outside lower center"
    figure.legend(entries.values(), entries.keys(), loc=place, ncols=columns, frameon=False)


@ft.lru_cache(maxsize=16)
def png(figure: "Figure") -> bytes:
    """A finished picture as PNG; cached for the file and the report."""
    content = io.BytesIO()
    figure.savefig(content, format="png", dpi=150)
    return content.getvalue()


def save(figure: "Figure", directory: Path, name: str) -> None:
    """Write a picture as PNG and print the path."""
    directory.mkdir(parents=True, exist_ok=True)
    path = directory / f"{name}.png"
    path.write_bytes(png(figure))
    print(f"wrote {path}")
