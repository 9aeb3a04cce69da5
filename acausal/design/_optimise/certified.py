"""Certificates: designs from the ends of searches.

A result changes between two points by the integral of its derivatives. Results that round, count or select have jumps,
where the integral misses the change. Between the jumps, their derivatives are zero or lack a part, and the conditions
of an optimum hold where there is none. A certificate therefore also compares values.
"""

import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..._declare.layout import determined_names
from ..._declare.node import leaves_of
from .._certificate.first_order import (
    ACTIVE,
    FEASIBLE,
    OPTIMAL,
    Multipliers,
    Point,
    ambiguous,
    multipliers_of,
    residual,
    unmoved,
    unqualified,
)
from .._certificate.second_order import REACH, UNKNOWN, Curvature, curvature_of, quadratic_of
from .._compute.evaluator import EXPLAINED, Evaluation
from .._problem.free import Place
from .._problem.free_parameters import model_or_reason
from .._problem.limits import Objective
from .._sensitivity.sensitivities import SensitivityTable, sensitivity_table
from .design import Design, Status
from .design_problem import DesignProblem
from .entries import Active, LimitedResult, Tried
from .local_search import SearchResult
from .task import Task

SHARE = 1e-3  # least share of a limit in a conflict
PIECES = 10  # most bisections for the integral of a derivative; a jump remains in one of them


def certified(problem: DesignProblem, outcome: SearchResult) -> Design[Any]:
    """A design with its certificate, from the end of a search."""
    task, point = outcome.task, outcome.point
    before = task.evaluator.evaluations
    found = task.evaluation(point.z)
    value = float(found.values[task.objective])
    multipliers = multipliers_of(point, task.bounds, task.is_equation)
    is_unbounded = outcome.conflict is None and task.is_unbounded(point)
    is_end = not (outcome.is_interrupted or outcome.conflict is not None or is_unbounded)
    idle = task.idle(point.z) if is_end else np.zeros(len(point.z), bool)
    curvature, flat = UNKNOWN, []
    if is_end:
        quadratic = quadratic_of(task.at, point, multipliers, task.bounds, task.is_equation, idle)
        curvature = curvature_of(task.at, point, quadratic, task.bounds, task.is_equation)
        flat = [pair.vector for pair in quadratic.flat]
    # At an interior optimum the gradient vanishes, so the curvature gives the scale of slopes.
    scale = max(float(np.max(np.abs(point.gradient))), float(np.max(np.abs(curvature.eigenvalues), initial=0.0))) or 1.0
    scale = scale if np.isfinite(scale) else 1.0
    kkt = residual(point, multipliers, task.is_equation, scale)
    unqualified_names = tuple(_named(task, unqualified(point, task.bounds, task.is_equation))) if is_end else ()
    contradictions = () if outcome.is_interrupted or is_unbounded else unexplained(task, point, flat, problem.objective)
    results = tuple(
        LimitedResult(limit, float(found.values[row])) for limit, row in zip(task.limits, task.rows, strict=True)
    )
    trail = outcome.trail
    model, unbuilt = model_or_reason(lambda: problem.free.with_values(problem.model, found.x))
    return Design(
        _model=model,
        unbuilt=unbuilt,
        free=problem.free,
        x=found.x,
        start=trail.start,
        status="unbounded" if is_unbounded else _status(outcome, kkt, curvature, contradictions, unqualified_names),
        objective_name=problem.objective.name,
        objective_scale=problem.objective.scale,
        objective=value,
        results=results,
        kkt_residual=kkt,
        active=tuple(_active(task, found, multipliers)),
        not_unique=tuple(_named(task, ambiguous(point, task.bounds, task.is_equation))),
        unmoved=tuple(
            one.name for one, is_one in zip(task.limits, unmoved(point, task.is_equation), strict=True) if is_one
        ),
        unqualified=unqualified_names,
        curvature=_shown(curvature, task, value),
        idle=tuple(name for name, is_one in zip(problem.free.names, idle, strict=True) if is_one),
        conflict={} if contradictions else _conflict(outcome),
        unexplained=contradictions,
        sensitivities=sensitivity_table(problem.objective.name, problem.objective.scale, value, []),
        history=tuple(_tried(task, step) for step in trail.steps),
        failed=tuple(_tried(task, step) for step in trail.failed),
        evaluations=trail.evaluations + task.evaluator.evaluations - before,
        seconds=trail.seconds,
    )


def _shown(curvature: Curvature, task: Task, value: float) -> Curvature:
    """Curvature relative to the value of the objective, or to its size for a value of zero."""
    factor = task.size / abs(value) if abs(value) > 1e-6 * task.size else 1.0
    scaled = {name: factor * getattr(curvature, name) for name in ("eigenvalues", "error", "kink", "least")}
    return dataclasses.replace(curvature, **scaled)


def _status(
    outcome: SearchResult,
    kkt: float,
    curvature: Curvature,
    unexplained: tuple[str, ...],
    unqualified_names: tuple[str, ...],
) -> Status:
    if outcome.is_interrupted:
        return "interrupted"
    if outcome.conflict is not None and not unexplained:
        return "infeasible"
    if kkt > OPTIMAL or curvature.is_far or unqualified_names or unexplained:
        return "not converged"
    return "optimal" if curvature.is_minimum else "stationary"


def _conflict(outcome: SearchResult) -> dict[str, float]:
    if outcome.conflict is None:
        return {}
    pairs = zip(outcome.task.limits, outcome.conflict.tolist(), strict=True)
    return {limit.name: share for limit, share in sorted(pairs, key=lambda pair: -pair[1]) if share > SHARE}


def _active(task: Task, found: Evaluation, multipliers: Multipliers) -> Any:
    slopes = np.asarray(task.free.slopes(found.x))
    for limit, multiplier in zip(task.limits, multipliers.constraints, strict=True):
        if multiplier != 0.0:
            yield Active(limit.name, limit.sense, float(multiplier) * task.size / limit.size, limit.scale)
    for i, variable in enumerate(task.free.variables):
        price = float(multipliers.lower[i] or multipliers.upper[i]) * task.size / float(slopes[i])
        if price:
            yield Active(variable.name, "lower bound" if multipliers.lower[i] else "upper bound", price, variable.scale)


def _named(task: Task, which: Multipliers) -> Iterator[str]:
    for limit, is_one in zip(task.limits, which.constraints, strict=True):
        if is_one:
            yield f"{limit.name} ({limit.sense})"
    for i, variable in enumerate(task.free.variables):
        if which.lower[i] or which.upper[i]:
            yield f"{variable.name} ({'lower' if which.lower[i] else 'upper'} bound)"


def _tried(task: Task, found: Evaluation) -> Tried:
    return Tried(found.x, float(found.values[task.objective]), found.values[task.rows], found.why)


def sensitivities_of(problem: DesignProblem, task: Task, design: Design[Any]) -> SensitivityTable:
    """Derivatives of the Lagrangian, f + sum_i lambda_i g_i, with respect to the fixed parameters."""
    weights = np.zeros(len(task.evaluator.names))
    weights[task.objective] = 1.0
    for active in design.active:
        for limit, row in zip(task.limits, task.rows, strict=True):
            if active.name == limit.name and active.side == limit.sense:
                weights[row] += limit.sign * active.multiplier
    gradient = task.evaluator.sensitivity(design.x, weights)
    slopes = {leaf.path: leaf.value for leaf in leaves_of(gradient)}
    free = {(place.path, place.element) for variable in problem.free.variables for place in variable.places}
    built = [place for variable in problem.free.variables for place in variable.places if place.built is not None]
    others = set(determined_names(problem.model)).union(*(place.determined for place in built))
    rows = []
    for leaf in leaves_of(problem.model):
        if leaf.declaration.role != "param" or leaf.path in others or slopes[leaf.path] is None:
            continue
        values, derivatives = np.asarray(leaf.value), np.asarray(slopes[leaf.path])
        for element in np.ndindex(values.shape):
            if (leaf.path, element or None) not in free:
                name, unit = Place(leaf.path, element or None).name, leaf.declaration.unit
                rows.append((name, unit, float(values[element]), float(derivatives[element])))
    return sensitivity_table(design.objective_name, design.objective_scale, design.objective, rows)


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
