"""Plots of power, energy and main results."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from .._measured import DEAD_TIME, FULL, MEASURED, Datum
from .._output import legend
from ._conditions import NO_LOAD
from ._rows import Row

AREAS: Mapping[str, str] = MappingProxyType(
    {"power to the clutch": "#009e73", "lost in the valve": "#e69f00", "surplus flow, and compression": "#d55e00"}
)
KINDS: Mapping[str, str] = MappingProxyType(
    {
        "winding": "#0072b2", "friction of motor and gears": "#56b4e9", "pump": "#cc79a7", "valves": "#e69f00",
        "surplus flow": "#d55e00", "line, seals, rest": "#7a7a7a",
    }
)  # fmt: skip
WHEN: Mapping[str, str] = MappingProxyType(
    {
        "opening": "at half the stroke, opening at full speed",
        "metered": "at half the stroke, opening along a profile",
        "holding": "holding",
    }
)
FIGURES: Mapping[str, tuple[str, float, str]] = MappingProxyType(
    {
        "opening_time": ("opening time [ms]", 1e3, "z.1f"),
        "motor_current": ("motor current, held [A]", 1.0, "z.2f"),
        "energy": ("energy of one operation [J]", 1.0, "z.0f"),
    }
)  # label, factor and format, by attribute of a row
THESIS: Mapping[str, Mapping[str, Datum]] = MappingProxyType(
    {
        "eccentric": {
            "opening_time": MEASURED["ema_maxon"][FULL]["opening time"],
            "motor_current": MEASURED["ema_maxon"][FULL]["holding current"],
        },
        "holding valve": {"opening_time": DEAD_TIME["opening time"]},
    }
)  # measurements on prototypes of these kinds
SURPLUS = ("relief", "compensator", "bleed")
TO_BAR, TO_LITRES = 1e-5, 6e4  # from Pa, and from m3/s to l/min


def kind_of(path: str) -> str:
    """The kind of a loss, from the path of the component."""
    first = path.split(".")[0]
    if path.endswith(("resistor", "coil")):
        return "winding"
    if first in ("motor", "gearbox", "screw", "worm", "crank"):
        return "friction of motor and gears"
    if first.startswith(SURPLUS):
        return "surplus flow"
    if first.startswith(("valve", "inlet", "outlet", "check", "purge")):
        return "valves"
    return "pump" if first == "pump" else "line, seals, rest"


def plot_areas(rows: Sequence[Row], titles: Mapping[str, str], figure: Figure | None = None) -> Figure:
    """Plots pressure over flow. The whole area is the power of the source; its parts are the clutch and the losses."""
    figure = figure or Figure(figsize=(10.0, 2.3 * len(rows) + 0.6), layout="constrained")
    panels = np.asarray(figure.subplots(len(rows), len(WHEN), squeeze=False, sharex=True, sharey=True))
    widest = max(row.flows[when]["source_q"] for row in rows for when in row.flows)
    highest = max(row.flows[when]["source_p"] for row in rows for when in row.flows)
    for line, row in zip(panels, rows, strict=True):
        for panel, (when, said) in zip(line, WHEN.items(), strict=True):
            _areas(panel, row.flows[when])
            panel.grid(alpha=0.3)
            title = titles[row.architecture] if when == "opening" else ""
            panel.set_title(f"{title}\n{said}", fontsize=9, loc="left")
            panel.tick_params(labelbottom=True, labelleft=True)
        line[0].set_ylabel("pressure [bar]")
    panels[0, 0].set_xlim(0.0, 1.05 * TO_LITRES * widest)
    panels[0, 0].set_ylim(0.0, 1.3 * TO_BAR * highest)
    for panel in panels[-1]:
        panel.set_xlabel("flow [l/min]")
    legend(figure, 3, above=True)
    return figure


def _areas(panel: Axes, flows: Mapping[str, float]) -> None:
    p, q = TO_BAR * flows["source_p"], TO_LITRES * flows["source_q"]
    load_p, load_q = TO_BAR * flows["clutch_p"], TO_LITRES * flows["clutch_q"]
    used = min(load_q, q)
    _area(panel, "power to the clutch", 0.0, 0.0, used, load_p)
    _area(panel, "lost in the valve", 0.0, load_p, used, p - load_p)
    _area(panel, "surplus flow, and compression", used, 0.0, q - used, p)
    powers = {name: 100.0 / 60.0 * area for name, area in (("source", p * q), ("clutch", load_p * used))}
    text = f"{powers['source']:.1f} W supplied, {powers['clutch']:z.1f} W to the clutch"
    if round(powers["source"], 1) == 0.0:
        text = f"no flow; {load_p:.0f} bar at the clutch"
    panel.text(0.97, 0.93, text, transform=panel.transAxes, ha="right", va="top", fontsize=8)


def _area(panel: Axes, name: str, x: float, y: float, width: float, height: float) -> None:
    panel.add_patch(Rectangle((x, y), width, height, color=AREAS[name], alpha=0.8, linewidth=0.0, label=name))


def plot_energies(rows: Sequence[Row], titles: Mapping[str, str], figure: Figure | None = None) -> Figure:
    """Plots the energy of one operation: losses by kind, and battery energy by part of the duty.

    Both differ by the energy stored at the end.
    """
    figure = figure or Figure(figsize=(12.0, 0.42 * len(rows) + 2.2), layout="constrained")
    losses, parts = np.ravel(np.asarray(figure.subplots(1, 2, sharex=True, sharey=True)))
    labels = [titles[row.architecture] for row in rows]
    tables = (
        (losses, list(KINDS), [_by_kind(row) for row in rows], KINDS),
        (parts, ["opening", "holding", "closing"], [row.energies for row in rows], _PHASES),
    )
    for panel, names, tallies, colors in tables:
        left = np.zeros(len(rows))
        for name in names:
            width = np.asarray([max(tally.get(name, 0.0), 0.0) for tally in tallies])
            panel.barh(labels, width, left=left, color=colors[name], label=name)
            left += width
        for place, total in enumerate(left):
            panel.text(total, place, f" {total:.0f} J", va="center", fontsize=8)
        panel.set_xlabel("energy of one operation [J]")
        panel.grid(alpha=0.3, axis="x")
    losses.invert_yaxis()
    losses.set_xlim(0.0, 1.12 * max(row.energy for row in rows))
    losses.set_title("losses", loc="left")
    parts.set_title("supplied by the battery", loc="left")
    legend(figure, 5)
    return figure


def plot_figures(rows: Sequence[Row], titles: Mapping[str, str], figure: Figure | None = None) -> Figure:
    """Plots opening times, currents and energies, with the measurements of the thesis on its prototypes."""
    figure = figure or Figure(figsize=(12.0, 0.36 * len(rows) + 1.6), layout="constrained")
    panels = np.ravel(np.asarray(figure.subplots(1, len(FIGURES), sharey=True)))
    places = range(len(rows))
    for panel, (name, (label, factor, form)) in zip(panels, FIGURES.items(), strict=True):
        values = [factor * max(getattr(row, name), 0.0) for row in rows]
        panel.barh(places, values, color="#0072b2", label="simulated")
        measured = [THESIS.get(row.architecture, {}).get(name) for row in rows]
        second = [row.conditions.get(NO_LOAD, {}).get(name) for row in rows]
        others = {place: factor * value for place, value in enumerate(second) if value is not None}
        if others:
            panel.plot(
                list(others.values()), list(others), "D", color="black", markerfacecolor="white", label=NO_LOAD,
                clip_on=False,
            )  # fmt: skip
        marks = {place: factor * datum.value for place, datum in enumerate(measured) if datum is not None}
        if marks:
            panel.plot(list(marks.values()), list(marks), "D", color="#d55e00", label="measured (thesis), in brackets")
        for place, value in zip(places, values, strict=True):
            mark = marks.get(place)
            said = "" if mark is None else f" ({mark:g})"
            panel.text(max(value, mark or 0.0), place, f"   {value:{form}}{said}", va="center", fontsize=8)
        panel.set_xlim(0.0, 1.5 * max([*values, *marks.values()]))
        panel.set_xlabel(label)
        panel.grid(alpha=0.3, axis="x")
    panels[0].set_yticks(places, [titles[row.architecture] for row in rows])
    panels[0].invert_yaxis()
    legend(figure, 3)
    return figure


_PHASES: Mapping[str, str] = MappingProxyType({"opening": "#009e73", "holding": "#8c564b", "closing": "#f0e442"})


def _by_kind(row: Row) -> dict[str, float]:
    found: dict[str, float] = {}
    for path, lost in row.losses.items():
        kind = kind_of(path)
        found[kind] = found.get(kind, 0.0) + lost
    return found
