"""Pictures of the comparison."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from acausal import Solution

from .._opening import STROKE
from .._output import ACTUATOR_NAMES, COLORS, legend
from ._rows import Row

PANELS = (
    ("opening_time", "opening time [ms]", 1e3),
    ("peak_current", "peak current [A]", 1.0),
    ("holding_current", "holding current at 12 mm [A]", 1.0),
    ("mode_frequency", "undamped modes at 6 mm [Hz]", 1.0),
)
SIGNALS = (
    ("slave.rod.s", "stroke of the slave [mm]", 1e3),
    ("motor.p.i", "motor current [A]", 1.0),
    ("line.p", "line pressure [bar]", 1e-5),
)


def plot_comparison(rows: list[Row]) -> Figure:
    """Thesis against model: a panel for each quantity, a line in it for each actuator and condition."""
    figure = Figure(figsize=(12.0, 8.0), layout="constrained")
    panels = np.ravel(np.asarray(figure.subplots(2, 2)))
    for panel, (quantity, label, scale) in zip(panels, PANELS, strict=True):
        _compare(panel, [row for row in rows if row.quantity.startswith(quantity)], label, scale)
    panels[-1].set_xscale("log")
    panels[-1].set_xlim(0.3, 3e3)
    legend(figure, 3)
    figure.suptitle("Clutch actuators: Meloni's thesis (2012) and the model")
    return figure


def _compare(panel: Axes, rows: list[Row], label: str, scale: float) -> None:
    lines = list(dict.fromkeys((row.actuator, row.condition) for row in rows))
    for row in rows:
        height, color, model = lines.index((row.actuator, row.condition)), COLORS[row.actuator], scale * row.model
        panel.plot(model, height, "D", color="black", markersize=6, label="model", zorder=3)
        if row.thesis is not None:
            measured = "measured" in row.source
            panel.plot([model, scale * row.thesis], [height, height], color=color, alpha=0.4, linewidth=3)
            panel.plot(
                scale * row.thesis, height, "o" if measured else "s", color=color, markersize=9,
                markerfacecolor=color if measured else "none",
                label="thesis, measured" if measured else "thesis, computed or in a table",
            )  # fmt: skip
    panel.set_yticks(range(len(lines)), [_name(*line) for line in lines], fontsize=9)
    panel.set_ylim(len(lines) - 0.5, -0.5)
    panel.set_xlim(left=0.0)
    panel.set_xlabel(label)
    panel.grid(axis="x", alpha=0.3)


def _name(actuator: str, condition: str) -> str:
    return ACTUATOR_NAMES[actuator] + ("" if condition == "base" else f"\n{condition}")


def plot_openings(runs: Mapping[str, Solution], rows: list[Row]) -> Figure:
    """Stroke, current and pressure over time, with the opening times that the thesis states."""
    figure = Figure(figsize=(9.0, 9.0), layout="constrained")
    panels = np.ravel(np.asarray(figure.subplots(3, 1, sharex=True)))
    for panel, (signal, label, scale) in zip(panels, SIGNALS, strict=True):
        for actuator, run in runs.items():
            panel.plot(1e3 * run.ts, scale * run[signal], color=COLORS[actuator], label=ACTUATOR_NAMES[actuator])
        panel.set_ylabel(label)
        panel.grid(alpha=0.3)
    panels[1].set_ylim(bottom=0.0)
    panels[0].axhline(1e3 * STROKE, color="black", linestyle=":", linewidth=1)
    for row in rows:
        if row.quantity == "opening_time" and row.condition == "base" and "measured" in row.source and row.thesis:
            panels[0].plot(1e3 * row.thesis, 1e3 * STROKE, "o", color=COLORS[row.actuator], markersize=8)
    panels[0].plot([], [], "o", color="black", label="open, as measured in the thesis")
    panels[0].legend(frameon=False, loc="lower right")
    panels[-1].set_xlabel("time [ms]")
    panels[-1].set_xlim(left=0.0)
    return figure
