"""What `control` found: the model with its signals, and the certificate of the optimum."""

import dataclasses
from collections.abc import Sequence
from typing import Any, Generic, TypeVar

import numpy as np

from ..._declare.component import Component
from ..._extras import Figure
from ..._integrate.columns import Item
from ..._integrate.solution import Solution
from .._optimise.design import Design
from .._optimise.entries import Tried
from .._problem.free import Free
from .horizon import Shooting

M = TypeVar("M", bound=Component)
PLANT, NODES = "plant.", "nodes["  # what the names of parameters in a horizon begin with, and those of its nodes
GAPS, WHOLE, LEAST_WHOLE = "segments join", "whole duration", "whole duration, at least"


@dataclasses.dataclass(frozen=True)
class Course(Generic[M]):
    """Signals that take a model where it is to be; `print` it for its certificate.

    - `model`: the model with the signals found; `duration`: in s.
    - `design`: the optimum with its certificate, as of `optimise`, without the states at which segments begin and the
      conditions that segments join. `gap` is the largest jump between two segments, in sizes of the states.
    - `solutions`: the run, or where there are segments or limits on the way, one after the other.
    """

    model: M
    duration: float
    design: Design[M]
    solutions: tuple[Solution[M], ...]
    gap: float

    @property
    def times(self) -> np.ndarray:
        """The times in s of the trajectories."""
        return np.concatenate([np.asarray(solution.ts) for solution in self.solutions])

    def __getitem__(self, name: str) -> np.ndarray:
        """The trajectory of a variable, at `times`."""
        return np.concatenate([np.asarray(solution[name]) for solution in self.solutions])

    def __str__(self) -> str:
        return str(self.design)

    def __repr__(self) -> str:
        return f"<Course of {type(self.model).__name__}: {self.design.status}, {self.duration:.6g} s>"

    def plot(self, *items: Item, units: Sequence[str] = ()) -> Figure:
        """Draw variables and expressions over time, a panel for each; returns the matplotlib figure.

        `items` and `units` are those of `Solution.plot`. A signal that was free is in the unit of its bounds.
        """
        from .plots import plot_course

        return plot_course(self, items, units)


def course_of(found: Design[Any], shooting: Shooting) -> Course[Any]:
    """The course that an optimum over a horizon is."""
    horizon = found.model
    solutions = tuple(shooting.solutions(horizon))
    gaps = [abs(result.value) for result in found.results if result.limit.name.startswith(GAPS)]
    design = _of_plant(found, shooting)
    return Course(design.model, float(shooting.times(horizon)[-1]), design, solutions, max(gaps, default=0.0))


def _of_plant(found: Design[Any], shooting: Shooting) -> Design[Any]:
    """The design in names of the model, without what lies between segments."""
    variables = found.free.variables
    kept = np.array([not variable.name.startswith(NODES) for variable in variables])
    shown = [i for i, result in enumerate(found.results) if not result.limit.name.startswith(GAPS)]
    free = Free(tuple(v._replace(name=_name(v.name)) for v, keep in zip(variables, kept, strict=True) if keep))

    given = {f"{signal}.times[{i}]" for signal in shooting.signals for i in range(len(shooting.times(found.model)))}

    def tried(one: Tried) -> Tried:
        return one._replace(x=one.x[kept], results=one.results[shown])

    return dataclasses.replace(
        found,
        model=shooting.model(found.model),
        free=free,
        x=found.x[kept],
        start=found.start[kept],
        results=tuple(found.results[i] for i in shown),
        active=tuple(a._replace(name=_name(a.name)) for a in found.active if not _is_inner(a.name)),
        not_unique=tuple(_name(name) for name in found.not_unique if not _is_inner(name)),
        unqualified=tuple(_name(name) for name in found.unqualified),
        idle=tuple(_name(name) for name in found.idle if not _is_inner(name)),
        conflict={_name(name): share for name, share in found.conflict.items()},
        sensitivities=tuple(
            row._replace(path=_name(row.path))
            for row in found.sensitivities
            if row.path.startswith(PLANT) and _name(row.path) not in given
        ),
        history=tuple(map(tried, found.history)),
        failed=tuple(map(tried, found.failed)),
    )


def _is_inner(name: str) -> bool:
    """Whether a name is that of a state between segments, or says that these join."""
    return name.startswith((GAPS, NODES))


def _name(name: str) -> str:
    return ", ".join(part.removeprefix(PLANT) for part in name.split(", "))
