"""Plot of the opening with a design, compared with the start of the search."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from acausal.design import Design

from .._output import legend
from ..actuators import opening
from ._problems import Problem

SIGNALS = (
    ("slave.rod.s", "stroke of the slave [mm]", 1e3, ""),
    ("motor.p.i", "motor current [A]", 1.0, "peak current"),
    ("line.p", "line pressure [bar]", 1e-5, "line pressure"),
)  # path, label, scale, and the limit of the peak value


def plot_opening(problem: Problem, design: Design[Any], rtol: float) -> Figure:
    """Plots stroke, current and pressure over time, before and after, with their limits."""
    figure = Figure(figsize=(11.0, 3.6), layout="constrained")
    panels = np.ravel(np.asarray(figure.subplots(1, len(SIGNALS))))
    runs = {"before": (problem.model, "0.5", "--"), "as designed": (design.model, "#0072b2", "-")}
    solutions = {name: opening(model, rtol=rtol) for name, (model, _, _) in runs.items()}
    limits = {result.limit.name: result.limit for result in design.results}
    for panel, (path, label, scale, limit) in zip(panels, SIGNALS, strict=True):
        for name, (_, color, style) in runs.items():
            run = solutions[name]
            panel.plot(1e3 * run.ts, scale * np.asarray(run[path]), style, color=color, label=name)
        if limit in limits:
            panel.axhline(scale * limits[limit].value, color="#d55e00", lw=1.0, label="limit")
        panel.set(xlabel="time [ms]", ylabel=label)
        panel.grid(alpha=0.3)
    legend(figure, 3)
    return figure
