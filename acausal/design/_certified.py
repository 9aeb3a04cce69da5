"""The end of a search as a design with its certificate."""

import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np

from .._declare.node import leaves_of
from ._certificate import UNKNOWN, Multipliers, ambiguous, curvature, multipliers_of, residual, unmoved
from ._design import Active, Design, Result, Sensitivity, Status, Tried
from ._free import Place
from ._problem import Problem
from ._program import Evaluation
from ._search import Outcome
from ._task import Task

OPTIMAL = 1e-6  # the residual of the conditions of an optimum
SHARE = 1e-3  # of a conflict, below which a limit has no part in it
DEEP = 1e6  # sizes of the objective below zero: no optimum is sought there
FAR = 1e3  # sizes of a variable without bounds,
FALLING = 1e-3  # and what the objective would fall by, as a fraction of it, where the variable was twice as large


def certified(problem: Problem, task: Task, outcome: Outcome) -> Design[Any]:
    before = task.program.evaluations
    found = task.evaluation(outcome.point.z)
    value = float(found.values[task.objective])
    # The certificate scales the objective by its value at the end.
    own = dataclasses.replace(task, size=abs(value) if abs(value) > 1e-6 * task.size else task.size)
    point = own.point(outcome.point.z, found)
    multipliers = multipliers_of(point, own.bounds, own.is_equation)
    kkt = residual(point, multipliers, own.is_equation)
    is_unbounded = _is_unbounded(task, outcome)
    is_end = not (outcome.is_interrupted or outcome.conflict is not None or is_unbounded)
    bent = curvature(own.at, point, multipliers, task.idle) if is_end else UNKNOWN
    results = tuple(Result(limit, float(found.values[row])) for limit, row in zip(task.limits, task.rows, strict=True))
    trail = outcome.trail
    return Design(
        model=problem.free.with_values(problem.model, found.x),
        free=problem.free,
        x=found.x,
        start=np.asarray(problem.free.unscaled(trail.start)),
        status="unbounded" if is_unbounded else _status(outcome, kkt, bent.verdict),
        objective_name=problem.objective.name,
        objective_scale=problem.objective.scale,
        objective=value,
        results=results,
        kkt_residual=kkt,
        active=tuple(_active(own, found, multipliers)),
        not_unique=tuple(_not_unique(own, ambiguous(point, own.bounds, own.is_equation))),
        unmoved=tuple(
            one.name for one, is_one in zip(task.limits, unmoved(point, own.is_equation), strict=True) if is_one
        ),
        curvature=bent,
        idle=tuple(name for name, is_one in zip(problem.free.names, task.idle, strict=True) if is_one),
        conflict=_conflict(task, outcome),
        sensitivities=(),
        history=tuple(_tried(task, step) for step in trail.steps),
        failed=tuple(_tried(task, step) for step in trail.failed),
        evaluations=trail.evaluations + task.program.evaluations - before,
        seconds=trail.seconds,
    )


def _is_unbounded(task: Task, outcome: Outcome) -> bool:
    """Whether the search ended far out, with all limits kept and the objective still falling."""
    point = outcome.point
    if outcome.conflict is not None or task.violation(point) > OPTIMAL:
        return False
    is_far = np.isinf(task.bounds).any(axis=0) & (np.abs(point.z) > FAR)
    return point.f < -DEEP or bool(np.any(is_far & (point.gradient * point.z < -FALLING * abs(point.f))))


def _status(outcome: Outcome, kkt: float, verdict: str) -> Status:
    if outcome.is_interrupted:
        return "interrupted"
    if outcome.conflict is not None:
        return "infeasible"
    if kkt > OPTIMAL:
        return "not converged"
    return "optimal" if verdict.startswith(("a strict", "a vertex")) else "stationary"


def _conflict(task: Task, outcome: Outcome) -> dict[str, float]:
    if outcome.conflict is None:
        return {}
    pairs = zip(task.limits, outcome.conflict.tolist(), strict=True)
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


def _not_unique(task: Task, which: Multipliers) -> Iterator[str]:
    for limit, is_one in zip(task.limits, which.constraints, strict=True):
        if is_one:
            yield f"{limit.name} ({limit.sense})"
    for i, variable in enumerate(task.free.variables):
        if which.lower[i] or which.upper[i]:
            yield f"{variable.name} ({'lower' if which.lower[i] else 'upper'} bound)"


def _tried(task: Task, found: Evaluation) -> Tried:
    return Tried(found.x, float(found.values[task.objective]), found.values[task.rows], found.why)


def sensitivities_of(problem: Problem, task: Task, design: Design[Any]) -> tuple[Sensitivity, ...]:
    """The derivative of the Lagrangian, f + sum_i lambda_i g_i, by the parameters that are not free."""
    weights = np.zeros(len(task.program.names))
    weights[task.objective] = 1.0
    for active in design.active:
        for limit, row in zip(task.limits, task.rows, strict=True):
            if active.name == limit.name and active.side == limit.sense:
                weights[row] += limit.sign * active.multiplier
    gradient = task.program.sensitivity(design.x, weights)
    slopes = {leaf.path: leaf.value for leaf in leaves_of(gradient)}
    free = {(place.path, place.element) for variable in problem.free.variables for place in variable.places}
    rows = []
    for leaf in leaves_of(problem.model):
        if leaf.declaration.role != "param" or slopes[leaf.path] is None:
            continue
        values, derivatives = np.asarray(leaf.value), np.asarray(slopes[leaf.path])
        for element in np.ndindex(values.shape):
            if (leaf.path, element or None) not in free:
                name, unit = Place(leaf.path, element or None).name, leaf.declaration.unit
                rows.append(Sensitivity(name, float(values[element]), unit, float(derivatives[element])))
    return tuple(rows)
