"""A picture of optimal signals and trajectories."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..._extras import Figure
from ..._integrate.results.columns import Column, Item, columns
from ..._integrate.results.solution_plot import axes_below
from .course import Course


def plot_course(course: Course[Any], items: Sequence[Item], units: Sequence[str]) -> Figure:
    """Variables and expressions over time, a panel for each, with lines between pieces."""
    pieces = zip(*(columns(solution, items, units) for solution in course.solutions), strict=True)
    found = [parts[0]._replace(values=np.concatenate([part.values for part in parts])) for parts in pieces]
    axes = axes_below(None, len(found))
    for ax, column in zip(axes, (_as_signal(course, column) for column in found), strict=True):
        ax.plot(course.times, column.values)
        ax.set_ylabel(f"{column.label}\n[{column.unit}]" if column.unit else column.label)
        for solution in course.solutions[1:]:
            ax.axvline(float(solution.ts[0]), color="0.85", linewidth=0.8, zorder=0)
    return axes[0].figure


def _as_signal(course: Course[Any], column: Column) -> Column:
    """A column to draw; a free signal in the unit of its bounds."""
    samples = f"{column.label.removesuffix('.y.value')}.values[0]"
    for variable in course.design.free.variables:
        if variable.name == samples and variable.scale.text:
            return column._replace(unit=variable.scale.unit, values=variable.scale.value(column.values))
    return column
