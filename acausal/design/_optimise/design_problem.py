"""A design problem as the user states it: model, free parameters, objective and limits."""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..._declare.component import Component
from ..._errors import ModelError
from .._compute.evaluator import Evaluator
from .._problem.free import Free
from .._problem.free_parameters import free_parameters, unbuilt_corners
from .._problem.limits import Limit, Objective, limits_of
from .._problem.types import ByPath, Function
from .design import Design
from .local_search import nearest_good
from .report import say_unbuilt
from .task import Task, task_of


@dataclasses.dataclass(frozen=True)
class DesignProblem:
    """Objective and limits of a design, with the evaluator that computes them."""

    model: Any
    free: Free
    objective: Objective
    limits: Mapping[str, Limit]
    evaluator: Evaluator

    @staticmethod
    def of(
        model: Any,
        free: ByPath[object],
        objectives: Sequence[Objective],
        run: Function | None,
        constraints: Mapping[str, object] | None,
        scenarios: Mapping[str, Mapping[str, object]] | None,
        progress: bool | None = None,
    ) -> "DesignProblem":
        if not isinstance(model, Component):
            raise ModelError(f"{model!r} is not a component. Give a model to optimise.")
        limits = limits_of(constraints)
        for objective in objectives:
            if objective.name in limits:
                raise ModelError(f"{objective.name} is the name of the objective and of a constraint. Rename one.")
        functions = {objective.name: objective.function for objective in objectives}
        functions |= {name: function for name, (function, _) in limits.items()}
        variables, stated = free_parameters(model, free), {name: limit for name, (_, limit) in limits.items()}
        evaluator = Evaluator(model, variables, functions, run, scenarios)
        say_unbuilt(unbuilt_corners(model, variables, scenarios or {"": {}}), progress)
        return DesignProblem(model, variables, objectives[0], stated, evaluator)

    def task(self, x: np.ndarray) -> Task:
        """The task, scaled by the results at `x`, or at the nearest design that can be computed."""
        task = task_of(self.evaluator, self.evaluator(x), self.objective.name, self.limits)
        good = nearest_good(task, np.asarray(self.free.scaled(x)))
        return task_of(self.evaluator, task.evaluation(good), self.objective.name, self.limits)


def starts_of(free: Free, model: Component, start: object) -> list[np.ndarray]:
    """Start values: those of the model with the given changes."""
    given = start if isinstance(start, list) else [start]
    return [_start(free, free.values(model), one) for one in given or [None]]


def _start(free: Free, x: np.ndarray, start: object) -> np.ndarray:
    if isinstance(start, str | Path):
        start = Design.load(start)
    given = start.values if isinstance(start, Design) else start
    if given is None:
        return x
    if not isinstance(given, Mapping):
        raise ModelError(
            f"start must be a dictionary of values by path, a Design, or the file of a Design; got {start!r}."
        )
    return free.changed(x, given)
