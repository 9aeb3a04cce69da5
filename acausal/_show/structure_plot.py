"""Plot of the structure of a system; needs matplotlib."""

import numpy as np

from .._evaluate.system import System
from .._extras import Axes, given_or_new
from .._reduce.sort import Sorted

_COLOURS = {"explicit": "tab:blue", "linear": "tab:orange", "nonlinear": "tab:red"}


def plot_structure(system: System, ax: Axes | None) -> Axes:
    """Incidence of the sorted equations, with outlined blocks and marked tearing variables and residuals."""
    ordered = system.ordered
    rows = [row for torn in system.torn for row in torn.rows]
    unknowns = [unknown for torn in system.torn for unknown in torn.unknowns]
    column_of = {unknown: i for i, unknown in enumerate(unknowns)}
    side = min(4.0 + 0.14 * len(rows), 12.0)
    ax = given_or_new(ax, side + 1.5, side)
    points = [
        (column_of[int(ordered.column[entry])], i)
        for i, row in enumerate(rows)
        for entry in ordered.entries_of_row[row]
        if ordered.column[entry] >= 0
    ]
    x, y = np.array(points).reshape(-1, 2).T
    ax.plot(x, y, ".", color="0.35", markersize=max(2.0, 7.0 - len(rows) / 25))
    _outline(system, ax)
    ax.set_xlim(-0.7, len(rows) - 0.3)
    ax.set_ylim(len(rows) - 0.3, -0.7)
    ax.set_aspect("equal")
    if len(rows) <= 60:
        ax.set_xticks(range(len(rows)), [ordered.unknown_name(u) for u in unknowns], rotation=90, fontsize=6)
        ax.set_yticks(range(len(rows)), [_short(equation_name(ordered, row)) for row in rows], fontsize=6)
    ax.set_xlabel("unknowns")
    ax.set_ylabel("equations")
    return ax


def equation_name(ordered: Sorted, row: int) -> str:
    """The name of an equation, with its number of differentiations."""
    level, name = ordered.table.place(row)[0].template.level, ordered.table.row_name(row)
    return name if level == 0 else f"d/dt {name}" if level == 1 else f"d{level}/dt{level} {name}"


def _short(name: str) -> str:
    """A label: only the first of the ports at a connection."""
    return name.replace("sum of flows at the connection of ", "flows at ").partition(",")[0]


def _outline(system: System, ax: Axes) -> None:
    from matplotlib.patches import Patch, Rectangle

    start = 0
    for torn in system.torn:
        size = len(torn.rows)
        ax.add_patch(Rectangle((start - 0.5, start - 0.5), size, size, alpha=0.25, color=_COLOURS[torn.method]))
        if torn.tears and size > 1:
            inner = len(torn.steps)
            ax.add_patch(
                Rectangle((start + inner - 0.5, start + inner - 0.5), len(torn.tears), len(torn.tears), fill=False,
                          linewidth=1.5, edgecolor="k")
            )  # fmt: skip
        start += size
    kinds = list(dict.fromkeys(torn.method for torn in system.torn))
    handles = [Patch(color=_COLOURS[kind], alpha=0.4, label=kind) for kind in kinds]
    ax.legend(handles=handles, loc="upper right", fontsize="small", title="blocks")
