"""Picture of the optima."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter

from .._output import ACTUATOR_NAMES, COLORS, legend
from ._main import Outcome

TALLEST = 2.2  # upper end of the vertical axis, relative to the optimum


def plot_optima(outcomes: Sequence[Outcome]) -> Figure:
    """Plots the opening time over the parameter: sweep, optimum, prototype, and the range that never opens."""
    figure = Figure(figsize=(5.0 * len(outcomes), 5.2), layout="constrained")
    panels = np.ravel(np.asarray(figure.subplots(1, len(outcomes))))
    for panel, outcome in zip(panels, outcomes, strict=True):
        _draw(panel, outcome)
    legend(figure, 4)
    return figure


def _draw(panel: Axes, outcome: Outcome) -> None:
    problem, finite = outcome.problem, np.isfinite(outcome.times)
    x, t = problem.scale.value(outcome.values), 1e3 * outcome.times
    panel.plot(x[finite], t[finite], "-", color=COLORS[problem.actuator], label="model")
    for low, high in _gaps(x, finite):
        panel.axvspan(low, high, color="black", alpha=0.12, linewidth=0, label="never opens")
    _draw_optimum(panel, outcome)
    panel.plot(
        problem.scale.value(problem.built), 1e3 * problem.measured, "D", color="#d55e00", markersize=8, zorder=4,
        label="thesis, as built and measured",
    )  # fmt: skip
    panel.set_xscale("log")
    panel.set_xlim(x[0], x[-1])
    panel.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    panel.xaxis.set_major_formatter(ScalarFormatter())
    panel.xaxis.set_minor_formatter(NullFormatter())
    panel.set_xlabel(problem.scale.headed(problem.parameter))
    panel.set_ylabel("opening time [ms]")
    panel.set_title(ACTUATOR_NAMES[problem.actuator])
    panel.grid(alpha=0.3)


def _draw_optimum(panel: Axes, outcome: Outcome) -> None:
    problem, best = outcome.problem, outcome.path[-1]
    x, t = problem.scale.value(best.x), 1e3 * best.value
    panel.plot(x, t, "*", color="gold", markeredgecolor="black", markersize=16, zorder=4, label="optimum, model")
    unit = problem.scale.text
    built, time = problem.scale.value(problem.built), float(np.interp(problem.built, outcome.values, outcome.times))
    text = f"optimum {x:.4g}{unit}: {t:.1f} ms\nas built {built:.4g}{unit}: {1e3 * time:.1f} ms"
    panel.text(0.5, 0.96, text, transform=panel.transAxes, ha="center", va="top", fontsize=10)
    panel.set_ylim(0.0, TALLEST * t)


def _gaps(x: np.ndarray, finite: np.ndarray) -> list[tuple[float, float]]:
    """Intervals of the sweep without a finite time, extended half way to the neighbouring finite points."""
    edges = np.concatenate([x[:1], np.sqrt(x[1:] * x[:-1]), x[-1:]])
    starts = np.flatnonzero(~finite & np.concatenate([[True], finite[:-1]]))
    ends = np.flatnonzero(~finite & np.concatenate([finite[1:], [True]]))
    return [(float(edges[start]), float(edges[end + 1])) for start, end in zip(starts, ends, strict=True)]
