"""Picture of the optimisation."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter

from .._output import ACTUATOR_NAMES, COLORS, legend
from ._main import Outcome

NUMBERED = 5  # points of the path that carry their number; those after them lie too close
TALLEST = 2.2  # of the vertical axis, in opening times of the optimum
_LABELS = {True: "simulation", False: "never opens: stepped back from"}


def plot_optima(outcomes: Sequence[Outcome]) -> Figure:
    """Opening time over the parameter: the sweep, the way the optimiser went, and where the clutch never opens."""
    figure = Figure(figsize=(5.0 * len(outcomes), 5.2), layout="constrained")
    panels = np.ravel(np.asarray(figure.subplots(1, len(outcomes))))
    for panel, outcome in zip(panels, outcomes, strict=True):
        _draw(panel, outcome)
    legend(figure, 3)
    return figure


def _draw(panel: Axes, outcome: Outcome) -> None:
    problem, finite = outcome.problem, np.isfinite(outcome.times)
    x, t = outcome.values / problem.scale, 1e3 * outcome.times
    panel.plot(x[finite], t[finite], ".-", color=COLORS[problem.actuator], label="sweep")
    for low, high in _gaps(x, finite):
        panel.axvspan(low, high, color="black", alpha=0.12, linewidth=0, label="never opens")
    _draw_path(panel, outcome)
    panel.plot(
        problem.built / problem.scale, 1e3 * problem.measured, "D", color="#d55e00", markersize=8, zorder=4,
        label="thesis: as built and measured",
    )  # fmt: skip
    panel.set_xscale("log")
    panel.set_xlim(x[0], x[-1])
    panel.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    panel.xaxis.set_major_formatter(ScalarFormatter())
    panel.xaxis.set_minor_formatter(NullFormatter())
    panel.set_xlabel(f"{problem.parameter} [{problem.shown_unit}]")
    panel.set_ylabel("opening time [ms]")
    panel.set_title(ACTUATOR_NAMES[problem.actuator])
    panel.grid(alpha=0.3)


def _draw_path(panel: Axes, outcome: Outcome) -> None:
    scale, (bottom, top) = outcome.problem.scale, panel.get_ylim()
    top = min(top, TALLEST * 1e3 * outcome.path[-1].value)
    places = [(point.x / scale, 1e3 * point.value if point.is_finite else top) for point in outcome.path]
    panel.plot(*zip(*places, strict=True), ":", color="black", linewidth=1, label="path of the optimiser")
    for number, (point, place) in enumerate(zip(outcome.path, places, strict=True), start=1):
        marker, color = ("o", "black") if point.is_finite else ("X", "red")
        panel.plot(*place, marker, color=color, markersize=6, clip_on=False, zorder=3, label=_LABELS[point.is_finite])
        if number <= NUMBERED:
            panel.annotate(str(number), place, xytext=(6, 5), textcoords="offset points", fontsize=10)
    x, t = places[-1]
    panel.plot(x, t, "*", color="gold", markeredgecolor="black", markersize=16, zorder=4, label="optimum")
    unit = "" if outcome.problem.shown_unit == "1" else f" {outcome.problem.shown_unit}"
    panel.text(0.5, 0.96, f"{x:.4g}{unit}, {t:.2f} ms", transform=panel.transAxes, ha="center", va="top", fontsize=11)
    panel.set_ylim(bottom, top)


def _gaps(x: np.ndarray, finite: np.ndarray) -> list[tuple[float, float]]:
    """Stretches of the sweep without a finite time, up to half way to the next one that has."""
    edges = np.concatenate([x[:1], np.sqrt(x[1:] * x[:-1]), x[-1:]])
    starts = np.flatnonzero(~finite & np.concatenate([[True], finite[:-1]]))
    ends = np.flatnonzero(~finite & np.concatenate([finite[1:], [True]]))
    return [(float(edges[start]), float(edges[end + 1])) for start, end in zip(starts, ends, strict=True)]
