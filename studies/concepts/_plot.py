"""Pictures of the designs."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt

from acausal.design import Front

from .._output import legend
from ._rows import Row
from ._targets import HYDRAULIC, OVERALL

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLORS: Mapping[str, str] = {"EMA": "#d55e00", "EHS, motor holds": "#009e73", "EHS, valve holds": "#0072b2"}
MARKS: Mapping[str, str] = {"FISE": "D", "RE 50": "o", "RE 40": "s", "RE 35": "v", "RE 30": "^"}


def plot_designs(rows: Sequence[Row], fronts: Mapping[tuple[str, str], Front[Any]]) -> "Figure":
    """Energy of a hold over opening time: fronts, optima, prototypes; the numbers at the marks are masses in kg."""
    figure, ax = plt.subplots(figsize=(9.0, 6.0), layout="constrained")
    for (concept, motor), front in fronts.items():
        style = "-" if motor == "RE 50" else "--"
        ax.plot(1e3 * front.values[:, 0], front.values[:, 1], style, color=COLORS[concept], label=f"{concept}, {motor}")
    for row in rows:
        if row.opening_time > 2.0 * OVERALL or "spring" in row.design:
            continue
        built, color = "2012" in row.design, COLORS.get(row.design, "0.2")
        color = "black" if built else color
        name = f"{row.motor}, {'2012' if built else row.design}"
        at = 1e3 * row.opening_time, row.holding_energy
        ax.plot(*at, MARKS[row.motor], color=color, mfc="white" if built else color, ms=8, ls="", label=name)
        if row.mass is not None and math.isfinite(row.mass):
            ax.annotate(f"{row.mass:.2g} kg", at, xytext=(6, 6), textcoords="offset points", fontsize="small")
    for time, name in ((HYDRAULIC, "target of the EHS"), (OVERALL, "target of all")):
        ax.axvline(1e3 * time, color="0.6", lw=1.0, ls=":")
        ax.text(
            1e3 * time, ax.get_ylim()[1], f" {name}", rotation=90, va="top", ha="right", color="0.4", fontsize="small"
        )
    ax.set_xlabel("opening time at 800 N [ms]")
    ax.set_ylabel("energy of a hold of 10 s [J]")
    ax.set_yscale("log")
    legend(figure, 3)
    return figure
