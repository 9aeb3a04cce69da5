"""The picture of the designs."""

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt

from .._output import legend
from ._rows import Row
from ._targets import HYDRAULIC, OVERALL

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLORS: Mapping[str, str] = {"EMA": "#d55e00", "EHS, motor holds": "#009e73", "EHS, valve holds": "#0072b2"}
MARKS: Mapping[str, str] = {"FISE": "D", "RE 50": "o", "RE 40": "s"}


def plot_designs(rows: Sequence[Row], fronts: Sequence[Row], products: Sequence[Row]) -> "Figure":
    """Energy of a hold over opening time: prototypes, optima, fronts, products."""
    figure, ax = plt.subplots(figsize=(10.0, 6.6), layout="constrained")
    for concept, color in COLORS.items():
        for motor, mark in MARKS.items():
            own = [row for row in fronts if (row.design, row.motor) == (f"{concept}, front", motor)]
            if own:
                label = f"{concept}, {motor}: front{_mass(own[0])}"
                ax.plot(*_places(own), "-" if motor == "RE 50" else "--", color=color, label=label)
            best = [row for row in rows if (row.design, row.motor) == (concept, motor)]
            for row in best:
                ax.plot(*_places(best), mark, color=color, ls="", label=f"{concept}, {motor}: optimum{_mass(row)}")
    for row in rows:
        if "2012" in row.design and row.design.endswith(" N"):
            name = f"{row.design.split(',')[0]}, {row.motor}{_mass(row)}"
            ax.plot(*_places([row]), MARKS[row.motor], color="black", mfc="white", ms=9, ls="", label=name)
        if "no-load" in row.design:
            ax.plot(*_places([row]), "s", color="0.5", ls="", label=f"EHS, valve holds, {row.motor}: less friction")
    ax.plot(*_places(products), "x", color="black", ls="", label="products")
    for time, name in ((HYDRAULIC, "target of the EHS"), (OVERALL, "target of all")):
        ax.axvline(1e3 * time, color="0.6", lw=1.0, ls=":")
        ax.annotate(
            f"{name} ", (1e3 * time, 0.8), xycoords=("data", "axes fraction"), rotation=90, va="center", ha="right",
            color="0.4", fontsize="small",
        )  # fmt: skip
    ax.set(xlabel="opening time at 800 N [ms]", ylabel="energy of a hold of 10 s [J]", ylim=(0.0, None))
    ax.grid(alpha=0.3)
    legend(figure, 3)
    return figure


def _places(rows: Iterable[Row]) -> Any:
    return zip(*((1e3 * row.opening_time, row.holding_energy) for row in rows), strict=True)


def _mass(row: Row) -> str:
    return "" if row.mass is None else f", {row.mass:.2g} kg"
