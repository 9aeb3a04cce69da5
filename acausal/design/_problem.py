"""An optimisation as it is stated: a model, what is free, what is minimised, and the limits of results."""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .._declare.component import Component
from .._errors import ModelError
from ._design import Design
from ._free import Free
from ._free_parameters import free_parameters
from ._limits import Limit, Objective, limits_of
from ._program import Program
from ._search import nearest_good
from ._task import Task, task_of
from ._types import ByPath, Function


@dataclasses.dataclass(frozen=True)
class Problem:
    """What is minimised under which limits, and the program that computes it."""

    model: Any
    free: Free
    objective: Objective
    limits: Mapping[str, Limit]
    program: Program

    @staticmethod
    def of(
        model: Any,
        free: ByPath[object],
        objectives: Sequence[Objective],
        run: Function | None,
        constraints: Mapping[str, object] | None,
        scenarios: Mapping[str, Mapping[str, object]] | None,
    ) -> "Problem":
        if not isinstance(model, Component):
            raise ModelError(f"{model!r} is no component: optimise a model.")
        limits = limits_of(constraints)
        for objective in objectives:
            if objective.name in limits:
                raise ModelError(f"{objective.name} is the name of the objective and of a constraint. Rename one.")
        functions = {objective.name: objective.function for objective in objectives}
        functions |= {name: function for name, (function, _) in limits.items()}
        variables = free_parameters(model, free)
        program = Program(model, variables, functions, run, scenarios)
        return Problem(model, variables, objectives[0], {name: pair[1] for name, pair in limits.items()}, program)

    def task(self, x: np.ndarray) -> Task:
        """The task, measured by what the results are at `x`, or next to it where these cannot be computed."""
        task = task_of(self.program, self.program(x), self.objective.name, self.limits)
        good = nearest_good(task, np.asarray(self.free.scaled(x)))
        return task_of(self.program, task.evaluation(good), self.objective.name, self.limits)


def starts_of(free: Free, model: Component, start: object) -> list[np.ndarray]:
    """The values to start from: those of the model, changed by what is given."""
    given = start if isinstance(start, list) else [start]
    return [_start(free, free.values(model), one) for one in given or [None]]


def _start(free: Free, x: np.ndarray, start: object) -> np.ndarray:
    if isinstance(start, str | Path):
        start = Design.load(start)
    given = start.values if isinstance(start, Design) else start
    if given is None:
        return x
    if not isinstance(given, Mapping):
        raise ModelError(f"start is a dictionary of values by path, a Design, or a file of one; got {start!r}.")
    return free.changed(x, given)
