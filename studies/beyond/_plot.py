"""Plots of each item, from its rows."""

import re
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
import numpy as np

from ..actuators import SUPPLY, WORN_LOAD, opening
from . import _line, _load, _passages, _profiles, _series, _temperature
from ._prototypes import PROTOTYPES
from ._row import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

OPENING = "opening time"
TARGET = 200.0  # ms, target of the thesis for all actuators


def _bars(ax: "Axes", rows: Sequence[Row], scale: float, label: str) -> None:
    """Draws a bar for each row, and the figures of the thesis as diamonds."""
    names = [row.case for row in rows]
    ax.barh(names, [scale * row.value for row in rows], color="tab:blue", height=0.6)
    measured = [(row.case, scale * row.thesis) for row in rows if row.thesis is not None]
    if measured:
        ax.plot(
            [x for _, x in measured], [name for name, _ in measured], "D", color="tab:orange", label="thesis, measured"
        )
        ax.legend(frameon=False)
    ax.set_xlabel(label)
    ax.invert_yaxis()
    ax.grid(axis="x", alpha=0.3)


def _of(rows: Sequence[Row], quantity: str, *, within: str = "") -> list[Row]:
    return [row for row in rows if row.quantity == quantity and within in row.case]


def plot_load(rows: Sequence[Row]) -> "Figure":
    """Plots the loads over the travel, and the opening times."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(12.0, 4.6), layout="constrained")
    travel, loads = _load.curves()
    for (name, load), color in zip(loads.items(), ("0.5", "tab:blue", "tab:red"), strict=True):
        left.plot(1e3 * travel, load, color=color, label=name)
    left.axhline(WORN_LOAD, color="0.6", ls=":", lw=1.0)
    left.annotate("thesis: 800 N, limited wear", (12.0, WORN_LOAD), ha="right", va="bottom", fontsize="small")
    left.set(xlabel="travel of the slave [mm]", ylabel="load at the slave [N]")
    left.legend(frameon=False, loc="lower right")
    _bars(right, _of(rows, OPENING), 1e3, "opening time [ms]")
    right.axvline(TARGET, color="0.6", ls=":", lw=1.0, label="thesis, target of 200 ms")
    right.legend(frameon=False, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    return figure


def plot_line(rows: Sequence[Row]) -> "Figure":
    """Plots the opening time over the length of the pipe."""
    figure, axes = plt.subplots(1, len(_line.ACTUATORS), figsize=(10.0, 4.0), layout="constrained")
    for ax, name in zip(axes, _line.ACTUATORS, strict=True):
        for what, style in ((_line.SPRING, ":"), (_line.FRICTION, "--"), (_line.WHOLE, "o-")):
            own = [row for row in _of(rows, OPENING, within=name) if row.case.endswith(f" m, {what}")]
            lengths = [float(re.findall(r", ([\d.]+) m", row.case)[0]) for row in own]
            ax.plot(lengths, [1e3 * row.value for row in own], style, label=what)
        ax.set(title=name, xlabel="length of the pipe, 4 mm wide [m]", ylabel="opening time [ms]")
        ax.grid(alpha=0.3)
    axes[0].legend(frameon=False)
    return figure


def plot_temperature(rows: Sequence[Row]) -> "Figure":
    """Plots the opening time over the temperature, and the allowed number of operations."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(12.0, 5.0), layout="constrained", width_ratios=(1.0, 1.1))
    for name, color in zip(_temperature.ACTUATORS, ("#d55e00", "#009e73"), strict=True):
        for what, style in (("all", "o-"), ("liquid alone", "s--")):
            own = _of(rows, OPENING, within=f"{name}, {what} at")
            at = [float(re.findall(r"at (-?\d+) C", row.case)[0]) for row in own]
            left.plot(at, [1e3 * row.value for row in own], style, color=color, label=f"{name}, {what}")
    left.axhline(TARGET, color="0.6", ls=":", lw=1.0)
    left.annotate("thesis, target of 200 ms", (-30.0, TARGET), va="bottom", fontsize="small")
    left.set(xlabel="temperature [degC]", ylabel="opening time [ms]")
    left.legend(frameon=False)
    left.grid(alpha=0.3)
    _bars(right, _of(rows, "operations allowed"), 1.0, "operations allowed [1/min]")
    for bars in right.containers:
        right.bar_label(bars, fmt="%.3g", padding=3, fontsize="small")
    right.margins(x=0.12)
    right.set_title("winding of the RE40 at 155 C at most, of the RE50 at 125 C", loc="left", fontsize="medium")
    return figure


def plot_passages(rows: Sequence[Row]) -> "Figure":
    """Plots the pressure drops of the housing as built; the thesis calls the result of its CFD small."""
    figure, ax = plt.subplots(figsize=(8.0, 3.0), layout="constrained")
    _bars(ax, _of(rows, "pressure drop"), 1e-5, "drop of the pressure side at the largest flow [bar]")
    ax.set_title("Passages as built; the thesis calls the drop small, without a number", loc="left", fontsize="medium")
    return figure


def plot_profiles(rows: Sequence[Row]) -> "Figure":
    """Plots voltage, travel and speed over time, at full voltage and with a soft landing."""
    names = list(PROTOTYPES)
    figure, axes = plt.subplots(3, len(names), figsize=(12.0, 6.6), layout="constrained", sharex="col")
    for name, (top, middle, bottom) in zip(names, axes.T, strict=True):
        full = opening(PROTOTYPES[name].build(), rtol=1e-6)
        soft = _profiles.landing(name, _profiles.RTOL)
        times = {row.case.rpartition(", ")[2]: 1e3 * row.value for row in _of(rows, OPENING, within=name)}
        top.plot(1e3 * full.ts, np.full(len(full.ts), SUPPLY), "--", color="0.5", label="full voltage")
        top.plot(1e3 * soft.times, soft["command.y.value"], color="tab:blue", label="soft")
        for ax, path, factor in ((middle, "slave.rod.s", 1e3), (bottom, "piston.v", 1e3)):
            ax.plot(1e3 * full.ts, factor * np.asarray(full[path]), "--", color="0.5")
            ax.plot(1e3 * soft.times, factor * soft[path], color="tab:blue")
        top.set_title(f"{name}: {times['full voltage']:.1f} ms, softly {times['soft']:.1f} ms", fontsize="medium")
        bottom.set_xlabel("time [ms]")
    for ax, label in zip(axes[:, 0], ("voltage [V]", "travel of the slave [mm]", "speed [mm/s]"), strict=True):
        ax.set_ylabel(label)
    for ax in axes.flat:
        ax.grid(alpha=0.3)
    axes[0, 0].legend(frameon=False, loc="lower left")
    return figure


def plot_series(rows: Sequence[Row]) -> "Figure":
    """Plots the effect of tightening each tolerance."""
    figure, ax = plt.subplots(figsize=(9.0, 4.6), layout="constrained")
    own = _of(rows, "reduction of the deviation")
    _bars(ax, own, 1e3, "decrease of the standard deviation [ms]")
    for i, row in enumerate(own):
        ax.annotate(
            row.remark, (1e3 * row.value, i), xytext=(4, 0), textcoords="offset points", va="center", fontsize=8
        )
    ax.set_xlim(0.0, 1.4e3 * float(np.max([row.value for row in own])))
    ax.set_title("Effect of halving one tolerance", loc="left")
    return figure


PICTURES: Mapping[str, Callable[[Sequence[Row]], "Figure"]] = {
    _load.ITEM: plot_load, _line.ITEM: plot_line, _temperature.ITEM: plot_temperature,
    _passages.ITEM: plot_passages, _profiles.ITEM: plot_profiles, _series.ITEM: plot_series,
}  # fmt: skip
