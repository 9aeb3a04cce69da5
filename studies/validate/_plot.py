"""Pictures of the comparison."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from acausal import Solution

from .._opening import STROKE
from .._output import ACTUATOR_NAMES, COLORS, new_figure
from ._rows import Row

PANELS = (
    ("opening_time", "opening time [ms]", 1e3),
    ("peak_current", "peak current [A]", 1.0),
    ("holding_current", "holding current at 12 mm [A]", 1.0),
    ("mode_frequency_1", "first mode [Hz]", 1.0),
    ("mode_frequency_2", "second mode [Hz]", 1.0),
)


def plot_comparison(rows: list[Row]) -> Figure:
    """Thesis against model, a panel for each quantity and a line for each actuator and condition."""
    figure = new_figure(12.0, 8.5)
    panels = list(np.ravel(np.asarray(figure.subplots(2, 3))))
    for panel, (quantity, label, scale) in zip(panels, PANELS, strict=False):
        _compare(panel, [row for row in rows if row.quantity == quantity], label, scale)
    handles, labels = panels[0].get_legend_handles_labels()
    panels[-1].axis("off")
    panels[-1].legend(handles, labels, loc="center", fontsize=11, frameon=False)
    return figure


def _compare(panel: Axes, rows: list[Row], label: str, scale: float) -> None:
    lines = list(dict.fromkeys((row.actuator, row.condition) for row in rows))
    for height, line in enumerate(lines):
        members = [row for row in rows if (row.actuator, row.condition) == line]
        model = scale * members[0].model
        panel.plot(model, height, "D", color="black", markersize=7, label="model" if height == 0 else None, zorder=3)
        for row in members:
            if row.thesis is not None:
                _dumbbell(panel, height, model, scale * row.thesis, "measured" in row.source)
    panel.set_yticks(range(len(lines)), [_name(*line) for line in lines], fontsize=8)
    panel.set_ylim(len(lines) - 0.5, -0.5)
    panel.set_xlabel(label)
    panel.set_xlim(left=0.0)
    panel.grid(axis="x", alpha=0.3)
