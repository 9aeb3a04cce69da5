"""What is said while an optimisation runs."""

import sys
import time
from collections.abc import Callable

import numpy as np

from .._progress import is_read, is_silent
from ._bar import EVERY, FAILURES
from ._limits import Objective
from ._program import Evaluation, Program
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


class Watch:
    """Is told of each design that a search computes. It says the first failures as they happen and, every now and then,
    how many designs were computed: in logs as well, unless `wanted` forbids it. When a search ends is not known before.
    """

    def __init__(self, program: Program, wanted: bool | None) -> None:
        self._program, self._wanted = program, wanted
        self._began = self._said = time.monotonic()

    def __call__(self, found: Evaluation) -> None:
        if is_silent(sys.stderr, self._wanted):
            return
        program, now = self._program, time.monotonic()
        if not found.is_good and program.failures <= FAILURES:
            print(f"design {program.evaluations} failed: {found.why}, {program.free.text(found.x)}", file=sys.stderr)
        if now - self._said >= EVERY:
            self._said, rate = now, program.evaluations / (now - self._began)
            count = f"{program.evaluations} designs, {program.failures} failed"
            print(f"{count}, {rate:.3g} per s, {now - self._began:.0f} s", file=sys.stderr)


def _worst(task: Task, values: np.ndarray) -> str:
    broken = [float(limit.violation(values[row])) for limit, row in zip(task.limits, task.rows, strict=True)]
    if max(broken, default=0.0) <= 1e-6:
        return ""
    worst = int(np.argmax(broken))
    return f", {task.limits[worst].name} broken by {broken[worst]:.2%}"
