"""Progress messages of an optimisation."""

import sys
import time
from collections.abc import Callable, Iterable

import numpy as np

from ..._progress import is_read, is_silent
from .._compute.cores import EVERY, FAILURES
from .._compute.evaluator import Evaluation, Evaluator
from .._problem.limits import Objective
from .task import Task

PAUSE = 1.0  # s between the steps that a log reports


def reporter(
    task: Task, objective: Objective, number: int, starts: int, wanted: bool | None
) -> Callable[[int, Evaluation], None]:
    """A function that prints a line for each step of a search, unless `wanted` is False. In a log, steps that follow
    each other within `PAUSE` are left out, unless `wanted` is True.
    """
    start = f"start {number + 1} of {starts}, " if starts > 1 else ""
    said = time.monotonic()

    def report(step: int, found: Evaluation) -> None:
        nonlocal said
        if not is_read(sys.stderr, wanted):
            if is_silent(sys.stderr, wanted) or time.monotonic() - said < PAUSE:
                return
            said = time.monotonic()
        shown = f"{objective.scale.value(found.values[task.objective]):.6g}{objective.scale.text}"
        print(f"{start}step {step}: {objective.name} {shown}{_worst(task, found.values)}", file=sys.stderr)

    return report


def say_unbuilt(corners: Iterable[str], wanted: bool | None) -> None:
    """Prints which corners of the bounds cannot be built, also in logs unless `wanted` is False."""
    said = [] if is_silent(sys.stderr, wanted) else list(corners)
    for text in said[:FAILURES]:
        print(f"corner of the bounds: {text}", file=sys.stderr)
    if said:
        more = f"{len(said) - FAILURES} more corners. " if len(said) > FAILURES else ""
        text = "Narrow the bounds, or state the condition as a constraint: an optimum beyond it has no model."
        print(f"{more}{text}", file=sys.stderr)


class ProgressReport:
    """Reports the first failures as they happen and regularly the number of designs, also in logs unless `wanted` is
    False. Searches call it after each design.
    """

    def __init__(self, evaluator: Evaluator, wanted: bool | None) -> None:
        self._evaluator, self._wanted = evaluator, wanted
        evaluator.progress = wanted
        self._began = self._said = time.monotonic()

    def __call__(self, found: Evaluation) -> None:
        if is_silent(sys.stderr, self._wanted):
            return
        evaluator, now = self._evaluator, time.monotonic()
        if not found.is_good and evaluator.failures <= FAILURES:
            text = f"{found.why}, {evaluator.free.text(found.x)}"
            print(f"design {evaluator.evaluations} failed: {text}", file=sys.stderr)
        if now - self._said >= EVERY:
            self._said, rate = now, evaluator.evaluations / (now - self._began)
            plural = "" if evaluator.evaluations == 1 else "s"
            count = f"{evaluator.evaluations} design{plural}, {evaluator.failures} failed"
            print(f"{count}, {rate:.3g} per s, {now - self._began:.0f} s", file=sys.stderr)


def _worst(task: Task, values: np.ndarray) -> str:
    broken = [float(limit.excess(values[row])) for limit, row in zip(task.limits, task.rows, strict=True)]
    if max(broken, default=0.0) <= 1e-6:
        return ""
    worst = int(np.argmax(broken))
    return f", {task.limits[worst].name} broken by {broken[worst]:.2%}"
