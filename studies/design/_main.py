"""`python -m studies design`."""

import base64
import dataclasses
import html
import io
from collections.abc import Iterable, Mapping
from pathlib import Path

from acausal.design import Design

from .._output import print_table, progress, require_matplotlib, write_json
from ._problems import PROBLEMS

HEADS = (
    "problem", "starts", "opening time [ms]", "status", "KKT residual", "active, one unit more buys", "simulations",
)  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Row:
    """Where one start of a problem has led; numbers in SI units, multipliers in s per unit of the limit."""

    problem: str
    start: Mapping[str, float]
    variables: Mapping[str, float]
    objective: float
    constraints: Mapping[str, float]
    kkt_residual: float
    active: Mapping[str, float]
    status: str
    simulations: int
    seconds: float


def main(json: Path | None = None, out: Path | None = None, rtol: float = 1e-9) -> list[Row]:
    """Optimise, print each certificate, and write rows to the file `json` and a report to the folder `out`."""
    if out is not None:
        require_matplotlib()
    designs: dict[str, Design] = {}
    for problem in progress(PROBLEMS, "designing"):
        designs[problem.name] = problem.solve(rtol)
        print(f"\n{problem.name}\n{'=' * len(problem.name)}\n{designs[problem.name]}")
    rows = [_row(name, end) for name, best in designs.items() for end in (best, *best.others)]
    print()
    print_table("Least opening times", HEADS, _cells(designs))
    if json is not None:
        write_json(json, rows)
    if out is not None:
        write_report(designs, out)
    return rows


def _row(name: str, design: Design) -> Row:
    return Row(
        name, dict(zip(design.free.names, design.start.tolist(), strict=True)), design.values, design.objective,
        {result.limit.name: result.value for result in design.results}, design.kkt_residual, design.multipliers,
        design.status, design.evaluations, design.seconds,
    )  # fmt: skip


def _cells(designs: Mapping[str, Design]) -> Iterable[tuple[str, ...]]:
    for name, design in designs.items():
        scale = design.objective_scale
        prices = (
            f"{active.name} ({active.multiplier * active.scale.factor / scale.factor:.3g} ms per {active.scale.unit})"
            for active in design.active
        )
        yield (
            name, str(len(design.others) + 1), f"{scale.value(design.objective):.6g}", design.status,
            f"{design.kkt_residual:.1e}", ", ".join(prices), str(design.total_evaluations),
        )  # fmt: skip


def write_report(designs: Mapping[str, Design], out: Path) -> None:
    """Pictures of all problems, and one page with them and the certificates."""
    out.mkdir(parents=True, exist_ok=True)
    parts = []
    for number, (name, design) in enumerate(designs.items(), start=1):
        buffer = io.BytesIO()
        figure = design.plot()
        figure.savefig(buffer, format="png", dpi=110)
        (out / f"design_{number}.png").write_bytes(buffer.getvalue())
        picture = base64.b64encode(buffer.getvalue()).decode()
        parts.append(
            f"<h2>{html.escape(name)}</h2>\n<pre>{html.escape(str(design))}</pre>\n"
            f'<img alt="{html.escape(name)}" src="data:image/png;base64,{picture}">'
        )
    head = '<!doctype html>\n<meta charset="utf-8">\n<title>Least opening times</title>\n<h1>Least opening times</h1>'
    (out / "design.html").write_text("\n".join([head, *parts]) + "\n")
    print(f"wrote {out / 'design.html'}")
