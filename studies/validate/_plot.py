"""Plots of the comparison."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from acausal import Solution

from .._output import ACTUATOR_NAMES, COLORS, legend
from ..actuators import STROKE
from ._linear import linear_actuator, linear_system
from ._rows import TOLERANCE, Row
from ._statements import GIVEN, LINEAR, NOT_COMPARABLE, PREDICTED, REFITTED
from ._words import readable, spoken

PANELS = (
    ("opening_time", "opening time [ms]", 1e3),
    ("peak_current", "peak current [A]", 1.0),
    ("holding_current", "motor current, held at 12 mm [A]", 1.0),
    ("mode_frequency", "undamped modes at 6 mm [Hz]", 1.0),
)
PARTS: Mapping[str, str] = MappingProxyType(
    {GIVEN: "0.6", PREDICTED: "#0072b2", REFITTED: "#e69f00", NOT_COMPARABLE: "#56b4e9"}
)  # colours by kind of figure
TICKS = (-100.0, -50.0, -20.0, -5.0, 0.0, 5.0, 20.0, 50.0, 200.0)  # %
WIDEST = 600.0  # %
SIGNALS = (
    ("slave.rod.s", "stroke of the slave [mm]", 1e3),
    ("motor.p.i", "motor current [A]", 1.0),
    ("line.p", "line pressure [bar]", 1e-5),
)


def plot_comparison(rows: Sequence[Row]) -> Figure:
    """Plots thesis and model, with a panel for each quantity and a line for each actuator and condition."""
    figure = Figure(figsize=(12.0, 8.0), layout="constrained")
    panels = np.ravel(np.asarray(figure.subplots(2, 2)))
    for panel, (quantity, label, scale) in zip(panels, PANELS, strict=True):
        _compare(panel, [row for row in rows if row.quantity.startswith(quantity)], label, scale)
    panels[-1].set_xscale("log")
    panels[-1].set_xlim(0.3, 3e3)
    legend(figure, 4)
    figure.suptitle("Clutch actuators: Meloni's thesis (2012) and the model")
    return figure


def _compare(panel: Axes, rows: Sequence[Row], label: str, scale: float) -> None:
    lines = list(dict.fromkeys((row.actuator, row.condition) for row in rows))
    for row in rows:
        height, color, model = lines.index((row.actuator, row.condition)), COLORS[row.actuator], scale * row.model
        panel.plot(model, height, "D", color="black", markersize=6, label="model", zorder=3)
        if row.no_load is not None:
            panel.plot(
                scale * row.no_load, height, "D", color="black", markerfacecolor="none", markersize=6,
                label="model, no-load set", zorder=3,
            )  # fmt: skip
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
    return ACTUATOR_NAMES[actuator] + ("" if condition == "base" else f"\n{readable(condition)}")


def plot_deviations(rows: Sequence[Row], figure: Figure | None = None) -> Figure:
    """Plots the deviation of each figure from the thesis, by actuator, coloured by kind.

    The scale is linear within the tolerance band, and logarithmic beyond it.
    """
    own = {name: [row for row in rows if row.actuator == name and row.thesis is not None] for name in COLORS}
    own = {name: chosen for name, chosen in own.items() if chosen}
    counts = [len(chosen) for chosen in own.values()]
    figure = figure or Figure(figsize=(11.0, 0.22 * sum(counts) + 0.5 * len(own) + 1.2), layout="constrained")
    panels = np.ravel(np.asarray(figure.subplots(len(own), 1, sharex=True, height_ratios=counts, squeeze=False)))
    for panel, (name, chosen) in zip(panels, own.items(), strict=True):
        _deviations(panel, chosen)
        panel.set_title(ACTUATOR_NAMES[name], loc="left", fontsize="medium", fontweight="bold")
    panels[0].set_xscale("symlog", linthresh=100.0 * TOLERANCE, linscale=0.6)
    panels[0].set_xlim(-WIDEST, WIDEST)
    panels[0].set_xticks(TICKS, [f"{tick:+g}" if tick else "0" for tick in TICKS])
    panels[-1].set_xlabel("model against thesis [%]; beyond the band the scale is logarithmic")
    legend(figure, 3)
    figure.suptitle("Deviation of the model from each figure of Meloni's thesis (2012)")
    return figure


def _deviations(panel: Axes, rows: Sequence[Row]) -> None:
    width = 100.0 * TOLERANCE
    panel.axvspan(-width, width, color="0.92", label=f"within {width:g} %: reproduced")
    for height, row in enumerate(rows):
        assert row.deviation is not None
        assert row.thesis is not None
        deviation = 100.0 * row.deviation
        panel.barh(height, deviation, color=PARTS[row.kind], label=row.kind)
        if row.no_load is not None:
            other = 100.0 * (row.no_load / row.thesis - 1.0)
            panel.plot(other, height, "D", color="black", markerfacecolor="none", markersize=5, label="no-load set")
        place, align = (4, "left") if deviation >= 0.0 else (-4, "right")
        panel.annotate(
            f"{deviation:+z.1f} %", (deviation, height), xytext=(place, 0), textcoords="offset points", va="center",
            ha=align, fontsize=7,
        )  # fmt: skip
    panel.set_yticks(range(len(rows)), [_row_name(row) for row in rows], fontsize=7)
    panel.set_ylim(len(rows) - 0.5, -0.5)
    panel.axvline(0.0, color="black", linewidth=1.0)
    panel.grid(axis="x", alpha=0.3)


def _row_name(row: Row) -> str:
    condition = "" if row.condition == "base" else f", {readable(row.condition)}"
    return f"{spoken(row.quantity)} ({row.source}{condition})"


def plot_linear(rows: Sequence[Row]) -> Figure:
    """Plots the present actuator as a linear system: gain over frequency, and energy distribution of its modes."""
    figure = Figure(figsize=(12.0, 5.2), layout="constrained")
    gain, shares = np.ravel(np.asarray(figure.subplots(1, 2)))
    stated = {(row.quantity, row.source): row for row in rows if (row.quantity, row.source) in _LINEAR}
    _gain(gain, [row for row in stated.values() if row.thesis is not None])
    _shares(shares, list(stated.values()))
    legend(figure, 4)
    figure.suptitle("The present actuator, linear and undamped")
    return figure


_LINEAR = {(statement.quantity, statement.source) for statement in LINEAR}


def _gain(panel: Axes, rows: Sequence[Row]) -> None:
    model = linear_actuator()
    frequencies = np.geomspace(0.05, 3e3, 4000)
    response = np.abs(np.asarray(linear_system(model).frequency_response(2.0 * np.pi * frequencies)))[:, 0]
    torque = float(model.actuator.motor.emf.k)
    panel.loglog(frequencies, response / torque, color=COLORS["sila"], label="model, force per torque of the motor")
    for row in rows:
        assert row.thesis is not None
        if row.quantity.startswith("mode_frequency"):
            panel.axvline(row.thesis, color="#d55e00", linestyle=":", label="thesis: modes, Table 4.2")
        if row.quantity == "static_gain":
            panel.axhline(row.thesis, color="#0072b2", linestyle="--", label="thesis: static gain 9.33e3 N/(N.m)")
    panel.set_xlabel("frequency [Hz]")
    panel.set_ylabel("force on the clutch per torque [N/(N.m)]")
    panel.grid(alpha=0.3)


def _shares(panel: Axes, rows: Sequence[Row]) -> None:
    chosen = [row for row in rows if row.quantity.startswith(("kinetic", "potential"))]
    for height, row in enumerate(chosen):
        panel.barh(height, row.model, color=COLORS["sila"], alpha=0.6, label="model")
        assert row.thesis is not None
        panel.plot(
            row.thesis, height, "s", color="#d55e00", markerfacecolor="none", markersize=9,
            label="thesis, tables 4.3 and 4.5",
        )  # fmt: skip
    panel.set_yticks(range(len(chosen)), [spoken(row.quantity) for row in chosen], fontsize=8)
    panel.set_ylim(len(chosen) - 0.5, -0.5)
    panel.set_xscale("log")
    panel.set_xlim(1e-5, 2.0)
    panel.set_xlabel("share of the energy of the mode [1]")
    panel.grid(axis="x", alpha=0.3)


def plot_openings(runs: Mapping[str, Solution], rows: Sequence[Row]) -> Figure:
    """Plots stroke, current and pressure over time, with the opening times of the thesis."""
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
    figure.suptitle("Clutch actuators opening at 13.5 V")
    return figure
