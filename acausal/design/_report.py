"""What is said while an optimisation runs."""

import sys
from collections.abc import Callable

import numpy as np

from .._progress import is_read
from ._limits import Objective
from ._program import Evaluation
from ._task import Task


def reporter(
    task: Task, objective: Objective, number: int, starts: int, wanted: bool | None
) -> Callable[[int, Evaluation], None]:
    """A function that prints a line for each step of a search: on a terminal, or as `wanted`."""
    start = f"start {number + 1} of {starts}, " if starts > 1 else ""

    def said(step: int, found: Evaluation) -> None:
        if not is_read(sys.stderr, wanted):
            return
        shown = f"{objective.scale.value(found.values[task.objective]):.6g}{objective.scale.text}"
        print(f"{start}step {step}: {objective.name} {shown}{_worst(task, found.values)}", file=sys.stderr)

    return said


def _worst(task: Task, values: np.ndarray) -> str:
    broken = [float(limit.violation(values[row])) for limit, row in zip(task.limits, task.rows, strict=True)]
    if max(broken, default=0.0) <= 1e-6:
        return ""
    worst = int(np.argmax(broken))
    return f", {task.limits[worst].name} broken by {broken[worst]:.2%}"
