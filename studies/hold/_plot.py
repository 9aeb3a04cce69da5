"""Pictures of the hold."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from acausal import Solution, displayed

from .._output import ACTUATOR_NAMES, COLORS, legend
from ._elasticities import Leaking
from ._runs import DURATION, top_up_times

SIGNALS = (
    ("slave.rod.s", "stroke of the slave [mm]", 1e3),
    ("line.p", "line pressure [bar]", 1e-5),
    ("motor.p.v", "motor voltage [V]", 1.0),
    ("motor.p.i", "motor current [A]", 1.0),
)
MEASURED = (18.0, 20.0)  # A, holding current of the motor in the thesis
BEFORE, AFTER = 5e-3, 20e-3  # s, window of the zoom on a top-up


def plot_runs(runs: Mapping[str, Solution]) -> Figure:
    """Plots stroke, pressure, voltage and current over the hold, at the end of the opening, and in the first top-up."""
    figure = Figure(figsize=(13.0, 10.0), layout="constrained")
    panels = np.asarray(figure.subplots(len(SIGNALS), 3, width_ratios=(2, 1, 1)))
    top_up = float(top_up_times(runs["valve_held"])[0])
    views = (
        ("the whole hold", "time [s]", 0.0, 1.0, 0.0, DURATION),
        ("end of the opening", "time [ms]", 0.0, 1e3, 0.1, 0.3),
        (f"top-up at {top_up:.2f} s", "time since its start [ms]", top_up, 1e3, -BEFORE, AFTER),
    )
    for column, (title, label, origin, scale, left, right) in zip(panels.T, views, strict=True):
        for panel, (signal, _, unit) in zip(column, SIGNALS, strict=True):
            for actuator, run in runs.items():
                _draw(panel, actuator, scale * (np.asarray(run.ts) - origin), unit * np.asarray(run[signal]))
            panel.set_xlim(scale * left, scale * right)
            panel.grid(alpha=0.3)
        column[0].set_title(title)
        column[-1].set_xlabel(label)
    for panel, (_, label, _) in zip(panels[:, 0], SIGNALS, strict=True):
        panel.set_ylabel(label)
    for panel in panels[0]:
        panel.set_ylim(11.6, 12.4)
    panels[1, 2].set_ylim(27.0, 31.0)
    panels[3, 0].axhspan(*MEASURED, color="black", alpha=0.2, label="thesis: measured holding current, 18 to 20 A")
    legend(figure, 3)
    return figure


def _draw(panel: Axes, actuator: str, x: np.ndarray, y: np.ndarray) -> None:
    panel.plot(x, y, color=COLORS[actuator], linewidth=1.2, label=ACTUATOR_NAMES[actuator])


def plot_energies(runs: Mapping[str, Solution], leaks: list[Leaking]) -> Figure:
    """Plots the battery energy over time, and its final value over the leakage resistance."""
    figure = Figure(figsize=(12.0, 5.2), layout="constrained")
    over_time, over_leakage = np.ravel(np.asarray(figure.subplots(1, 2)))
    for actuator, run in runs.items():
        _draw(over_time, actuator, np.asarray(run.ts), np.asarray(run.integrals["motor"] + run.integrals["coil"]))
    valve = runs["valve_held"]
    over_time.plot(
        valve.ts, valve.integrals["motor"], ":", color=COLORS["valve_held"],
        label=f"{ACTUATOR_NAMES['valve_held']}: motor alone",
    )  # fmt: skip
    over_time.set_xlim(0.0, DURATION)
    over_time.set_ylim(bottom=0.0)
    over_time.set_xlabel("time [s]")
    over_time.set_ylabel("energy from the battery [J]")
    over_time.grid(alpha=0.3)
    _sweep(over_leakage, leaks)
    legend(figure, 3)
    return figure


def _leakage(row: Leaking) -> float:
    """The leakage resistance in bar.s/cm3."""
    return displayed(row.leakage_resistance, "Pa.s/m3")[0]


def _sweep(panel: Axes, leaks: list[Leaking]) -> None:
    for actuator in dict.fromkeys(row.actuator for row in leaks):
        rows = [row for row in leaks if row.actuator == actuator]
        x, y = [_leakage(row) for row in rows], [row.energy for row in rows]
        panel.plot(x, y, "o-", color=COLORS[actuator], markersize=5, label=ACTUATOR_NAMES[actuator])
    for row in leaks:
        if row.actuator == "valve_held":
            place = (_leakage(row), row.energy)
            panel.annotate(str(row.top_ups), place, xytext=(0, 8), textcoords="offset points", ha="center")
    panel.text(0.5, 0.3, "numbers: top-ups", transform=panel.transAxes, ha="center", color=COLORS["valve_held"])
    panel.set_xscale("log")
    panel.set_ylim(bottom=0.0)
    panel.set_xlabel("leakage resistance of the seals [bar.s/cm³]")
    panel.set_ylabel(f"energy from the battery in {DURATION:g} s [J]")
    panel.grid(alpha=0.3)
