"""Plots of the prototypes."""

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .._measured import DEAD_TIME, MEASURED
from .._output import legend
from ..actuators import STROKE
from ._plane import FRICTIONS, RESISTANCES, opening_times
from ._proposals import GRID, Proposal

HUES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")
WIDTHS = (3.6, 2.8, 2.0, 1.2)  # decreasing, so that coincident lines are all visible
TABLE_8_2 = (0.309, 4e-3)  # ohm, N.m.s/rad


def plot_plane(fits: Mapping[str, Any]) -> Figure:
    """Plots resistances and frictions that give the measured times and peak currents of the RE50, within one sigma."""
    figure = Figure(figsize=(9.0, 6.0), layout="constrained")
    panel = figure.subplots()
    for (voltage, found), hue in zip(opening_times().items(), HUES, strict=False):
        measured = MEASURED["ema_maxon"][voltage]
        time, peak = measured["opening time"], measured["peak current"]
        levels = [time.value - time.sigma, time.value, time.value + time.sigma]
        values = np.where(np.isfinite(found), found, 1.0)
        panel.contour(RESISTANCES, 1e3 * FRICTIONS, values, levels, colors=hue, linestyles=(":", "-", ":"))
        said = f"{1e3 * time.value:g} ms at {voltage:g} V, dotted {1e3 * time.sigma:g} ms more or less"
        panel.plot([], [], color=hue, label=said)
        low, high = voltage / (peak.value + peak.sigma), voltage / (peak.value - peak.sigma)
        panel.axvspan(low, high, color=hue, alpha=0.15, label=f"peak of {peak.value:g} A, a tenth more or less")
    panel.plot(TABLE_8_2[0], 1e3 * TABLE_8_2[1], "s", color="black", markersize=9, label="thesis, Table 8.2")
    for (name, fit), marker in zip(fits.items(), "ov^DP", strict=False):
        R, C = fit.estimates[:2]
        panel.plot(R, 1e3 * C, marker, color="#7f3c8d", markersize=8, markerfacecolor="none", label=f"fit: {name}")
    panel.set_xlabel("resistance [ohm]")
    panel.set_ylabel("viscous friction at the motor [1e-3 N.m.s/rad]")
    panel.grid(alpha=0.3)
    legend(figure, 2)
    figure.suptitle("EMA with the RE50: parameters that fit its opening times and peak currents")
    return figure


def plot_dead_time(records: Mapping[str, Any]) -> Figure:
    """Plots voltage, current, pressure and stroke of each explanation, with the measurements."""
    signals = (
        ("motor.p.v", "voltage [V]", 1.0), ("motor.p.i", "current [A]", 1.0), ("line.p", "pressure [bar]", 1e-5),
        ("slave.rod.s", "stroke [mm]", 1e3),
    )  # fmt: skip
    figure = Figure(figsize=(9.0, 10.0), layout="constrained")
    panels = np.ravel(np.asarray(figure.subplots(4, 1, sharex=True)))
    for panel, (signal, label, scale) in zip(panels, signals, strict=True):
        for (name, run), hue, width in zip(records.items(), HUES, WIDTHS, strict=True):
            panel.plot(1e3 * GRID, scale * np.asarray(run[signal]), color=hue, linewidth=width, label=name)
        panel.set_ylabel(label)
        panel.grid(alpha=0.3)
    panels[1].axhline(DEAD_TIME["peak current"].value, color="black", linestyle=":", label="thesis: measured peak")
    dead, opened = (1e3 * DEAD_TIME[name].value for name in ("dead time", "opening time"))
    panels[3].plot(opened, 1e3 * STROKE, "o", color="black", label="thesis: open at 130 ms")
    panels[3].axvspan(0.0, dead, color="0.88", label="thesis: no motion for 30 ms")
    panels[3].set_xlabel("time since the voltage was switched on [ms]")
    panels[3].set_xlim(0.0, 1.02e3 * GRID[-1])
    legend(figure, 4)
    figure.suptitle("EHS: four explanations, each fitted to opening time, dead time and peak current")
    return figure


def plot_proposals(proposals: Sequence[Proposal], subject: str, figure: Figure | None = None) -> Figure:
    """Plots the predictions of further measurements, with two sigma of noise (thick) and of noise and parameters."""
    chosen = [item for item in proposals if item.subject == subject]
    measurements = list(dict.fromkeys(item.measurement for item in chosen))
    figure = figure or Figure(figsize=(4.0 * len(measurements), 4.2), layout="constrained")
    panels = np.ravel(np.asarray(figure.subplots(1, len(measurements))))
    for panel, measurement in zip(panels, measurements, strict=True):
        _predictions(panel, [item for item in chosen if item.measurement == measurement])
    legend(figure, 4)
    figure.suptitle(f"{subject[0].upper()}{subject[1:]}: predictions of the explanations for proposed measurements")
    return figure


def _predictions(panel: Axes, items: Sequence[Proposal]) -> None:
    scale, unit = (1e3, "ms") if items[0].unit == "s" else (1.0, items[0].unit)
    for number, (item, hue) in enumerate(zip(items, HUES, strict=False)):
        if np.isfinite(item.predicted) and np.isfinite(item.spread):
            place, whole = scale * item.predicted, 2.0 * scale * float(np.hypot(item.noise, item.spread))
            panel.errorbar(number, place, yerr=whole, fmt="o", color=hue, capsize=6, label=item.explanation)
            panel.errorbar(number, place, yerr=2.0 * scale * item.noise, color=hue, elinewidth=5, alpha=0.5)
        else:
            said = "never" if np.isfinite(item.spread) else "perhaps\nnever"
            panel.text(number, 0.5, said, color=hue, transform=panel.get_xaxis_transform(), ha="center")
    panel.set_xlim(-0.5, len(items) - 0.5)
    panel.set_xticks([])
    panel.set_title(textwrap.fill(items[0].measurement, 36), fontsize=9)
    panel.set_ylabel(f"predicted [{unit}]")
    panel.grid(axis="y", alpha=0.3)
