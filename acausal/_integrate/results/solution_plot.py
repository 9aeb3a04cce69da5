"""Plots of trajectories and of modes over time, of one run or several; needs matplotlib."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from ..._errors import ModelError
from ..._extras import Axes, Panels, panels
from ..._units.parsing import common_unit
from ..._units.quantity import from_si
from .columns import Column, Item, columns, named_modes
from .solution import Solution

HEIGHT = 0.7  # of a band of modes, relative to the distance of the rows
Events = bool | str | Sequence[str]  # whether to mark events, or the names of parts and kinds of those to mark


def plot_solution(
    solution: Solution,
    items: Sequence[Item | list[Item]],
    units: Sequence[str],
    events: Events,
    axes: Panels | None,
) -> np.ndarray:
    """Draws one panel for each unit or list, and one for modes; see `Solution.plot`."""
    single = [item for item in items if not isinstance(item, list)]
    found = columns(solution, single if items else _states(solution), units) if single or not items else []
    modes = [column for column in found if column.names] + ([] if items else _changing_modes(solution))
    lines = [column for column in found if not column.names]
    panels: dict[str, list[Column]] = {}
    for column in lines:
        panels.setdefault(column.unit, []).append(column)
    together = [_in_one_unit(columns(solution, item, units)) for item in items if isinstance(item, list)]
    every = [*together, *panels.values()]
    axes = axes_below(axes, len(every) + bool(modes))
    for ax, panel in zip(axes, every, strict=False):
        for column in panel:
            _draw(ax, solution, column, column.label)
        ax.set_ylabel(f"[{panel[0].unit}]" if panel[0].unit else "")
        ax.legend(loc="best", fontsize="small", frameon=False)
    if modes:
        draw_modes(axes[-1], np.asarray(solution.ts), modes)
    if events is not False:
        _mark_events(axes, solution, "black", events)
    return axes


def _in_one_unit(panel: list[Column]) -> list[Column]:
    """The columns of one panel. Those without a known unit, such as a setpoint, take that of the others, and 1/s is
    rad/s beside a speed.
    """
    units = list(dict.fromkeys(column.unit for column in panel if column.unit))
    unit = common_unit(units)
    if not panel or (units and not unit):
        raise ModelError(
            f"A list of items is one panel, so they have one unit, got {', '.join(units) or 'an empty list'}. Remedy: "
            "give units, as in ('load.w', 'rpm'), or several lists."
        )
    return [
        column._replace(unit=unit)
        if column.unit or not units
        else column._replace(unit=unit, values=from_si(column.values, unit, column.label))
        for column in panel
    ]


def _changing_modes(solution: Solution) -> list[Column]:
    """The discrete variables with names of their values that change during the run."""
    paths = named_modes(solution)
    found = columns(solution, list(paths), ()) if paths else []
    return [column for column in found if np.ptp(column.values)]


def compare(
    runs: Mapping[str, Solution],
    *items: Item,
    units: Sequence[str] = (),
    events: Events = False,
    axes: Panels | None = None,
) -> np.ndarray:
    """Overlay several runs, one panel for each variable or expression; returns the matplotlib axes.

    `runs` maps the names in the legend to solutions, as in `{"ratio 10": a, "ratio 20": b}`. The models may differ if
    each has the items drawn. `items`, `units` and `events` are as in `Solution.plot`; without items, the common states
    of all runs are drawn.

    Raises `ModelError` if there is nothing to compare, or for a batch instead of single runs.
    """
    if not isinstance(runs, Mapping) or not runs:
        raise ModelError("compare takes a dictionary of one or more solutions, as in compare({'cold': a, 'warm': b}).")
    items = items or tuple(_common_states(list(runs.values())))
    if not items:
        raise ModelError("The runs have no states in common: name the items to draw, as in compare(runs, 'load.w').")
    found = {name: columns(solution, items, units) for name, solution in runs.items()}
    labels = list(dict.fromkeys(column.label for those in found.values() for column in those))
    axes = axes_below(axes, len(labels))
    for number, (name, those) in enumerate(found.items()):
        for ax, column in zip(axes, those, strict=True):
            _draw(ax, runs[name], column, name, color=f"C{number}")
            ax.set_ylabel(f"{column.label}\n[{column.unit}]" if column.unit else column.label)
        if events is not False:
            _mark_events(axes, runs[name], f"C{number}", events)
    axes[0].legend(loc="best", fontsize="small", frameon=False)
    return axes


def _states(solution: Solution) -> list[str]:
    return [name for name in solution.system.state_names if not name.startswith("der(")]


def _common_states(solutions: Sequence[Solution]) -> list[str]:
    return [name for name in _states(solutions[0]) if all(name in other for other in solutions[1:])]


def axes_below(axes: Panels | None, count: int) -> np.ndarray:
    """A column of `count` axes over time, or the axes given."""
    axes = panels(axes, count, 1, (7.0, 1.0 + 1.7 * count), sharex=True)[:, 0]
    for ax in axes:
        ax.grid(alpha=0.3)
    axes[-1].set_xlabel("time [s]")
    return axes


def _draw(ax: Axes, solution: Solution, column: Column, label: str, **style: Any) -> None:
    """Draws a trajectory, or one for each element of an array variable."""
    for curve, values in column.curves(label):
        ax.plot(np.asarray(solution.ts), values, label=curve, **style)


def _mark_events(axes: np.ndarray, solution: Solution, colour: str, events: Events) -> None:
    if solution.system.events is None:
        return
    log = solution.events
    if not isinstance(events, bool):
        log = log.of(*([events] if isinstance(events, str) else events))
    times, style = np.asarray(log.times), {"linewidth": 0.6, "linestyle": ":", "alpha": 0.6, "zorder": 0}
    for ax in axes:
        ax.vlines(times, 0.0, 1.0, color=colour, transform=ax.get_xaxis_transform(), **style)


def draw_modes(ax: Axes, times: np.ndarray, modes: Sequence[Column]) -> None:
    """Draw a row for each discrete variable, with a band for each interval in which it has one value."""
    words = list(dict.fromkeys(word for column in modes for _, _, word in _intervals(times, column)))
    for row, column in enumerate(modes):
        for start, end, word in _intervals(times, column):
            style = {"color": f"C{words.index(word)}", "alpha": 0.5, "linewidth": 0.0}
            ax.broken_barh([(start, end - start)], (row - HEIGHT / 2, HEIGHT), **style)
    for number, word in enumerate(words):  # one entry in the legend for each word
        ax.broken_barh([], (0.0, 0.0), color=f"C{number}", alpha=0.5, label=word)
    ax.set_yticks(range(len(modes)), [column.label for column in modes])
    ax.set_ylim(len(modes) - 0.5, -0.5)
    ax.grid(visible=False, axis="y")
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=5, fontsize="small", frameon=False)


def _intervals(times: np.ndarray, column: Column) -> list[tuple[float, float, str]]:
    """Start, end and name of each interval in which a discrete variable is constant."""
    names, values = column.names or {}, column.values.astype(float).tolist()
    edges = [0, *(np.flatnonzero(np.diff(column.values)) + 1).tolist(), len(times) - 1]
    return [
        (float(times[start]), float(times[end]), names.get(values[start], f"{values[start]:g}"))
        for start, end in pairwise(edges)
    ]
