"""Plot of the designs."""

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt

from .._output import legend
from ._rows import Row
from ._targets import HYDRAULIC, OVERALL

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLORS: Mapping[str, str] = {"EMA": "#d55e00", "EHS, motor holds": "#009e73", "EHS, valve holds": "#0072b2"}
NEAR = 0.03  # of the axes; points closer than this share a label
ASIDE = ((7, 7), (7, -13), (-7, 7), (-7, -13), (7, 19), (7, -25), (-7, 19), (-7, -25))  # offsets of labels in points


def plot_designs(rows: Sequence[Row], fronts: Sequence[Row], products: Sequence[Row]) -> "Figure":
    """Plots holding energy over opening time of prototypes, optima, fronts and products, with motor and mass."""
    figure, ax = plt.subplots(figsize=(11.0, 7.0), layout="constrained")
    named: list[tuple[Row, str, str]] = []
    for concept, color in COLORS.items():
        for motor in dict.fromkeys(row.motor for row in fronts):
            own = [row for row in fronts if (row.design, row.motor) == (f"{concept}, front", motor)]
            if own:
                ax.plot(*_places(own), "-", color=color, lw=1.0, label="front of time and energy")
                named.append((own[-1], f"{motor}, front", color))
        best = [row for row in rows if row.design == concept]
        if best:
            ax.plot(*_places(best), "o", color=color, ls="", label=f"{concept}: optimum of each motor")
            named += [(row, row.motor + _mass(row), color) for row in best]
    for row in rows:
        if "2012" in row.design and row.design.endswith(" N"):
            ax.plot(*_places([row]), "D", color="black", mfc="white", ms=8, ls="", label="prototypes of 2012")
            named.append((row, f"{row.design.split(',')[0]}, {row.motor}{_mass(row)}", "black"))
        if "no-load" in row.design:
            ax.plot(*_places([row]), "s", color="0.5", ls="", label="EHS, valve holds: no-load set")
            named.append((row, f"{row.motor}, no-load set", "0.4"))
    ax.plot(*_places(products), "x", color="0.3", ls="", label="products")
    named += [(row, row.motor + _mass(row), "0.3") for row in products]
    for time, name in ((HYDRAULIC, "target of the EHS"), (OVERALL, "target of all")):
        ax.axvline(1e3 * time, color="0.6", lw=1.0, ls=":")
        ax.annotate(
            f"{name} ", (1e3 * time, 0.8), xycoords=("data", "axes fraction"), rotation=90, va="center", ha="right",
            color="0.4", fontsize="small",
        )  # fmt: skip
    ax.set(xlabel="opening time at 800 N [ms]", ylabel="energy of a hold of 10 s [J]", ylim=(0.0, None))
    ax.margins(x=0.1)
    ax.grid(alpha=0.3)
    legend(figure, 4)
    figure.draw_without_rendering()  # computes the layout
    _label(ax, named)
    return figure


def _label(ax: "Axes", named: Sequence[tuple[Row, str, str]]) -> None:
    """Labels the points, each at the first offset without overlap. Near points with the same label share one."""
    taken = [text.get_window_extent() for text in ax.texts]
    places: list[tuple[float, float, str]] = []
    for row, text, color in named:
        place = (1e3 * row.opening_time, row.holding_energy)
        x, y = ax.transAxes.inverted().transform(ax.transData.transform(place))
        if any(text == other and abs(u - x) < 4.0 * NEAR and abs(v - y) < NEAR for u, v, other in places):
            continue
        for side in ASIDE:
            label = ax.annotate(
                text, place, xytext=side, textcoords="offset points", color=color, fontsize=8,
                ha="left" if side[0] > 0 else "right",
            )  # fmt: skip
            box = label.get_window_extent()
            if box.x0 > ax.bbox.x0 and box.y0 > ax.bbox.y0 and not box.count_overlaps(taken):
                taken.append(box)
                places.append((x, y, text))
                break
            label.remove()


def _places(rows: Iterable[Row]) -> Any:
    return zip(*((1e3 * row.opening_time, row.holding_energy) for row in rows), strict=True)


def _mass(row: Row) -> str:
    return "" if row.mass is None else f", {row.mass:.2g} kg"
