"""`pareto`: trade-off between two results."""

import dataclasses
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, TypeVar

import numpy as np

from ..._analyse.table import aligned
from ..._declare.component import Component
from ..._errors import DesignWarning, ModelError, reason_of
from ..._extras import Axes
from ..._integrate.setup.options import count, one_of
from ..._units.display import Scale
from .._problem.limits import Limit, Objective, objectives_of
from .._problem.types import ByPath
from .design import Design
from .design_problem import DesignProblem, starts_of
from .local_search import SearchResult, Trail, search
from .optimise import METHODS, certified_or_kept
from .report import ProgressReport, reporter
from .solve import Method
from .task import Task

M = TypeVar("M", bound=Component)


@dataclasses.dataclass(frozen=True)
class Front(Generic[M]):
    """Pareto front: designs from the minimum of the first result to the minimum of the second one.

    `values[i]` are the two results of `designs[i]`. A design between the ends minimises the first result with the
    second one limited to its value, so the multiplier of this limit is the slope of the front. After an interrupt,
    `is_interrupted`, designs are missing between the ends or at one of them.
    """

    names: tuple[str, str]
    scales: tuple[Scale, Scale]
    values: np.ndarray
    designs: tuple[Design[M], ...]
    is_interrupted: bool = False

    def __str__(self) -> str:
        variables = self.designs[0].free.variables
        scales = [*self.scales, *(variable.scale for variable in variables)]
        names = [*self.names, *(variable.name for variable in variables)]
        heads = (scale.headed(name) for scale, name in zip(scales, names, strict=True))
        rows = [
            (*(f"{scale.value(x):.6g}" for scale, x in zip(scales, [*both, *design.x], strict=True)), design.status)
            for both, design in zip(self.values, self.designs, strict=True)
        ]
        return aligned([(*heads, ""), *rows]) + ("\ninterrupted: designs are missing" if self.is_interrupted else "")

    def __repr__(self) -> str:
        return f"<Front of {self.names[0]} and {self.names[1]}: {len(self.designs)} designs>"

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws the front; returns the matplotlib axes."""
        from .design_plots import plot_front

        return plot_front(self, ax)


def pareto(
    model: M,
    free: ByPath[object],
    minimise: Mapping[str, object],
    *,
    points: int = 9,
    run: Callable[[M], Any] | None = None,
    constraints: Mapping[str, object] | None = None,
    scenarios: Mapping[str, Mapping[str, object]] | None = None,
    start: object = None,
    method: Method = "SLSQP",
    most: int = 200,
    progress: bool | None = None,
) -> Front[M]:
    """Pareto front of the two results in `minimise`, by the epsilon-constraint method.

    The ends are the optima of either result; variables without effect on it minimise the other one. Between the ends,
    each design minimises the first result from the design before, with the second one limited to evenly spaced values.
    All share one compiled program, and each has its certificate. The other arguments are those of `optimise`. A
    keyboard interrupt ends the search with the designs so far.

    Source: Haimes, Lasdon and Wismer, IEEE Trans. SMC 1 (1971) 296.

    Raises the errors of `optimise`, and `ModelError` unless there are two results and at least two points.
    """
    objectives = objectives_of(minimise)
    if len(objectives) != 2:
        raise ModelError(f"pareto takes two functions to minimise, by name; got {len(objectives)}.")
    first, second = objectives
    if count(points, "points") < 2:
        raise ModelError("A front has two ends: points must be at least 2.")
    one_of(method, "method", METHODS)
    problem = DesignProblem.of(model, free, objectives, run, constraints, scenarios, progress)
    problem.evaluator.watch = ProgressReport(problem.evaluator, progress)

    def posed(objective: Objective, x: np.ndarray, limits: Mapping[str, Limit]) -> tuple[DesignProblem, Task]:
        stated = dataclasses.replace(problem, objective=objective, limits={**problem.limits, **limits})
        return stated, stated.task(x)

    def searched(task: Task, objective: Objective, x: np.ndarray, number: int) -> SearchResult:
        trail = Trail(report=reporter(task, objective, number, points, progress))
        return search(task, np.asarray(task.free.scaled(x)), trail, method, most)

    def an_end(objective: Objective, other: Objective, x: np.ndarray, number: int) -> Design[M]:
        """The optimum of one result; variables without effect on it minimise the other one."""
        stated, task = posed(objective, x, {})
        found = searched(task, objective, x, number)
        task, z = found.task, found.point.z
        idle = task.idle(z)
        if not np.any(idle) or found.conflict is not None or found.is_interrupted:
            return certified_or_kept(stated, found)
        _, rest = posed(other, np.asarray(task.free.unscaled(z)), {})
        low, high = rest.bounds
        first = np.asarray(rest.free.scaled(task.free.unscaled(z)))
        within = np.where(idle, low, first), np.where(idle, high, first)
        least = search(dataclasses.replace(rest, within=within), first, Trail(), method, most)
        there = least.task.evaluation(least.point.z)
        point = task.point(np.asarray(task.free.scaled(there.x)), there)
        return certified_or_kept(stated, dataclasses.replace(found, point=point))

    def value(objective: Objective, design: Design[M]) -> float:
        return float(problem.evaluator(design.x).values[problem.evaluator.owners.index(objective.name)])

    designs = [an_end(first, second, starts_of(problem.free, model, start)[0], 0)]
    try:
        _raise_interrupted(designs)
        designs.append(an_end(second, first, designs[0].x, points - 1))
        _raise_interrupted(designs)
        levels = np.linspace(value(second, designs[0]), value(second, designs[1]), points)[1:-1]
        for number, level in enumerate(levels.tolist(), start=1):
            x = designs[number - 1].x
            stated, task = posed(first, x, {second.name: Limit(second.name, "<=", level, second.scale)})
            designs.insert(number, certified_or_kept(stated, searched(task, first, x, number)))
            _raise_interrupted(designs)
        is_interrupted = False
    except (KeyboardInterrupt, Exception) as error:
        is_interrupted = True
        if not isinstance(error, KeyboardInterrupt):
            warnings.warn(f"The front ended early: {reason_of(error)}", DesignWarning, stacklevel=2)
    values = np.array([[value(objective, design) for objective in objectives] for design in designs])
    return Front((first.name, second.name), (first.scale, second.scale), values, tuple(designs), is_interrupted)


def _raise_interrupted(designs: Sequence[Design[Any]]) -> None:
    """Raises `KeyboardInterrupt` after an interrupted search."""
    if any(design.status == "interrupted" for design in designs):
        raise KeyboardInterrupt
