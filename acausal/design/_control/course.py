"""Result of `control`: the model with its signals, and the certificate of the optimum."""

import dataclasses
import re
import warnings
from collections.abc import Sequence
from typing import Any, Generic, TypeVar

import numpy as np

from ..._declare.component import Component
from ..._errors import DesignWarning, reason_of
from ..._extras import Figure
from ..._integrate.results.columns import Column, Item, columns
from ..._integrate.results.solution import Solution
from ..._integrate.results.solution_plot import axes_below
from .._optimise.design import Design
from .._optimise.entries import Tried
from .._problem.free import Free
from .horizon import Shooting

M = TypeVar("M", bound=Component)
PLANT, NODES = "plant.", "nodes["  # prefixes of names of parameters in a horizon, and of its nodes
_PREFIX = re.compile(rf"(?<![\w.]){re.escape(PLANT)}")
GAPS, WHOLE, LEAST_WHOLE = "segments join", "whole duration", "whole duration, at least"


@dataclasses.dataclass(frozen=True)
class Course(Generic[M]):
    """Optimal signals and trajectories; `print` it for its certificate.

    - `model`: the model with the optimal signals; `duration`: in s.
    - `design`: the optimum with its certificate, as from `optimise`, without the states between segments and their
      continuity constraints. `gap` is the largest jump between segments, relative to the sizes of the states.
    - `solutions`: the run, or the runs of the pieces if there are segments or path limits.
    """

    model: M
    duration: float
    design: Design[M]
    solutions: tuple[Solution[M], ...]
    gap: float

    @property
    def times(self) -> np.ndarray:
        """Times of the trajectories in s."""
        return np.concatenate([np.asarray(solution.ts) for solution in self.solutions])

    def __getitem__(self, name: str) -> np.ndarray:
        """The trajectory of a variable at `times`."""
        return np.concatenate([np.asarray(solution[name]) for solution in self.solutions])

    def __str__(self) -> str:
        return str(self.design)

    def __repr__(self) -> str:
        return f"<Course of {type(self.model).__name__}: {self.design.status}, {self.duration:.6g} s>"

    def plot(self, *items: Item, units: Sequence[str] = ()) -> Figure:
        """Draws variables and expressions over time, a panel for each; returns the matplotlib figure.

        `items` and `units` are those of `Solution.plot`. A free signal is in the unit of its bounds.
        """

        return plot_course(self, items, units)


def course_of(found: Design[Any], shooting: Shooting) -> Course[Any]:
    """The result of `control` from the optimum over a horizon."""
    horizon = found.model
    solutions = _solutions(shooting, horizon)
    gaps = [abs(result.value) for result in found.results if result.limit.name.startswith(GAPS)]
    design = _of_plant(found, shooting)
    return Course(design.model, float(shooting.times(horizon)[-1]), design, solutions, max(gaps, default=0.0))


def _solutions(shooting: Shooting, horizon: Any) -> tuple[Solution[Any], ...]:
    """The runs of the pieces, up to one that fails."""
    found = []
    try:
        for solution in shooting.solutions(horizon):
            found.append(solution)
    except (KeyboardInterrupt, Exception) as error:
        warnings.warn(f"The trajectories end early: {reason_of(error)}", DesignWarning, stacklevel=4)
    return tuple(found)


def _of_plant(found: Design[Any], shooting: Shooting) -> Design[Any]:
    """The design with the names of the model, without the states and constraints between segments."""
    variables = found.free.variables
    kept = np.array([not variable.name.startswith(NODES) for variable in variables])
    shown = [i for i, result in enumerate(found.results) if not result.limit.name.startswith(GAPS)]
    free = Free(tuple(v._replace(name=_name(v.name)) for v, keep in zip(variables, kept, strict=True) if keep))

    given = {f"{signal}.times[{i}]" for signal in shooting.signals for i in range(len(shooting.times(found.model)))}

    def tried(one: Tried) -> Tried:
        return one._replace(x=one.x[kept], results=one.results[shown])

    return dataclasses.replace(
        found,
        _model=shooting.model(found.model),
        free=free,
        x=found.x[kept],
        start=found.start[kept],
        results=tuple(found.results[i] for i in shown),
        active=tuple(a._replace(name=_name(a.name)) for a in found.active if not _is_inner(a.name)),
        not_unique=tuple(_name(name) for name in found.not_unique if not _is_inner(name)),
        unqualified=tuple(_name(name) for name in found.unqualified),
        idle=tuple(_name(name) for name in found.idle if not _is_inner(name)),
        unexplained=tuple(_PREFIX.sub("", sentence) for sentence in found.unexplained),
        conflict={_name(name): share for name, share in found.conflict.items()},
        sensitivities=found.sensitivities._replace(
            rows=tuple(
                row._replace(parameter=_name(row.parameter))
                for row in found.sensitivities.rows
                if row.parameter.startswith(PLANT) and _name(row.parameter) not in given
            )
        ),
        history=tuple(map(tried, found.history)),
        failed=tuple(map(tried, found.failed)),
    )


def _is_inner(name: str) -> bool:
    """Whether a name is that of a state or a constraint between segments."""
    return name.startswith((GAPS, NODES))


def _name(name: str) -> str:
    return ", ".join(part.removeprefix(PLANT) for part in name.split(", "))


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
