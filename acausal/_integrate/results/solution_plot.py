"""Plots of trajectories, of one run or several; needs matplotlib."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..._errors import ModelError
from ..._extras import Axes, Panels, panels
from .columns import Column, Item, columns
from .solution import Solution


def plot_solution(
    solution: Solution, items: Sequence[Item], units: Sequence[str], events: bool, axes: Panels | None
) -> np.ndarray:
    """Draws one panel for each unit; see `Solution.plot`."""
    found = columns(solution, items or _states(solution), units)
    panels = list(dict.fromkeys(column.unit for column in found))
    axes = axes_below(axes, len(panels))
    for ax, panel in zip(axes, panels, strict=True):
        for column in found:
            if column.unit == panel:
                _draw(ax, solution, column, column.label)
        ax.set_ylabel(f"[{panel}]" if panel else "")
        ax.legend(loc="best", fontsize="small", frameon=False)
    if events:
        _mark_events(axes, solution, "black")
    return axes


def compare(
    runs: Mapping[str, Solution],
    *items: Item,
    units: Sequence[str] = (),
    events: bool = False,
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
        if events:
            _mark_events(axes, runs[name], f"C{number}")
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
    times, values = np.asarray(solution.ts), column.values
    for place in np.ndindex(values.shape[1:]):
        number = f"[{', '.join(map(str, place))}]" if place else ""
        ax.plot(times, values[(slice(None), *place)], label=f"{label}{number}", **style)


def _mark_events(axes: np.ndarray, solution: Solution, colour: str) -> None:
    if solution.system.events is not None:
        for ax in axes:
            for time in np.asarray(solution.events.times).tolist():
                ax.axvline(time, color=colour, linewidth=0.6, linestyle=":", alpha=0.6, zorder=0)
