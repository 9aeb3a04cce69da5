"""Changes of results that their derivatives do not explain: jumps, and functions that are constant in steps.

A function changes between two points by the integral of its derivatives. Functions that round, count or select have
jumps, where the integral misses the change. Between the jumps, their derivatives are zero or lack a part, and the
conditions of an optimum hold where there is none. A certificate therefore also compares values.
"""

import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from .._certificate.first_order import ACTIVE, FEASIBLE, Point
from .._certificate.second_order import REACH
from .._compute.evaluator import EXPLAINED, Evaluation
from .._problem.limits import Objective
from .task import Task

PIECES = 10  # most bisections for the integral of a derivative; a jump remains in one of them


def unexplained(task: Task, point: Point, flat: Sequence[np.ndarray], objective: Objective) -> tuple[str, ...]:
    """Sentences about changes of results around a point that the derivatives do not explain.

    They are sought along each variable, and along the `flat` directions, which have no curvature.

    A better design near the point must differ from it by a change that the derivatives explain. A better design is
    feasible with a lower objective. For an infeasible point, it has a smaller violation.
    """
    here, found = task.evaluation(point.z), dict[int, str]()
    for variable, there in task.without_slopes(point.z).jumps.items():
        row = int(np.flatnonzero(task.are_changes(here, there))[0])
        found[variable] = _sentence(task, objective, row, here, there, 0.0)
    for direction, z in _beside(task, point, flat):
        if direction not in found and (there := task.evaluation(z)).is_good:
            for row in _rows_of_better(task, point, task.point(z, there)):
                explained = _explained(task, point.z, z, row)
                change = there.values[row] - here.values[row]
                if task.are_changes(here, there)[row] and abs(change - explained) > EXPLAINED * abs(change):
                    found[direction] = _sentence(task, objective, row, here, there, explained)
                    break
    return tuple(dict.fromkeys(found.values()))


def _beside(task: Task, point: Point, flat: Sequence[np.ndarray]) -> Iterator[tuple[int, np.ndarray]]:
    """Points `REACH` away along each variable and each flat direction, with the number of the direction; also those at
    the bounds if the point is infeasible.
    """
    low, high = task.bounds
    steps = [REACH, np.inf] if task.violation(point) > FEASIBLE else [REACH]
    for variable in range(len(point.z)):
        for step in (sign * step for step in steps for sign in (1.0, -1.0)):
            z = point.z.copy()
            z[variable] = np.clip(z[variable] + step, low[variable], high[variable])
            if np.all(np.isfinite(z)) and z[variable] != point.z[variable]:
                yield variable, z
    for direction, vector in enumerate(flat, len(point.z)):
        yield direction, np.clip(point.z + REACH * vector, low, high)


def _rows_of_better(task: Task, point: Point, other: Point) -> list[int]:
    """Rows of the results that distinguish a better point; empty for one that is not better."""
    before = task.violation(point)
    if before > FEASIBLE:
        is_broken = np.where(task.is_equation, np.abs(point.c), point.c) > FEASIBLE
        return task.rows[is_broken].tolist() if task.violation(other) < before - FEASIBLE else []
    if task.violation(other) > FEASIBLE or other.f >= point.f:
        return []
    return [task.objective, *task.rows[np.abs(point.c) <= ACTIVE].tolist()]


def _explained(task: Task, first: np.ndarray, last: np.ndarray, row: int) -> float:
    """The change of a result between two points by the trapezoidal rule from its derivatives, with bisection where it
    deviates most. It is the change itself if a point in between cannot be computed.
    """
    points = [(z, task.evaluation(z)) for z in (first, last)]
    change = float(points[-1][1].values[row] - points[0][1].values[row])
    gaps = [change]
    for _ in range(PIECES):
        gaps = [
            float(b.values[row] - a.values[row])
            - 0.5 * float((_slopes(task, a, row) + _slopes(task, b, row)) @ (y - z))
            for (z, a), (y, b) in itertools.pairwise(points)
        ]
        if abs(sum(gaps)) <= EXPLAINED * abs(change):
            break
        i = int(np.argmax(np.abs(gaps)))
        middle = 0.5 * (points[i][0] + points[i + 1][0])
        found = task.evaluation(middle)
        if not found.is_good:
            return change
        points.insert(i + 1, (middle, found))
    return change - sum(gaps)


def _slopes(task: Task, found: Evaluation, row: int) -> np.ndarray:
    return found.jacobian[row] * np.asarray(task.free.slopes(found.x))


def _sentence(
    task: Task, objective: Objective, row: int, here: Evaluation, there: Evaluation, explained: float
) -> str:  # fmt: skip
    """The change of a result between two designs, and the part that its derivatives explain."""
    names, scales = {task.objective: objective.name}, {task.objective: objective.scale}
    names |= {number: limit.name for number, limit in zip(task.rows, task.limits, strict=True)}
    scales |= {number: limit.scale for number, limit in zip(task.rows, task.limits, strict=True)}
    change, part = (
        f"{scales[row].difference(value):.6g}{scales[row].text}"
        for value in (there.values[row] - here.values[row], explained)
    )
    moved = [i for i in range(len(here.x)) if here.x[i] != there.x[i]]
    ends = [
        ", ".join(f"{v.name} = {v.text(x[i])}" for i in moved for v in [task.free.variables[i]])
        for x in (here.x, there.x)
    ]
    reason = f"its derivatives explain {part} of this" if explained else "its derivatives are zero"
    return f"{names[row]} changes by {change} from {ends[0]} to {ends[1]}, but {reason}"
