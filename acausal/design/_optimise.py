"""`optimise`: the free parameters of a model that minimise a result of its runs while others keep their limits."""

import concurrent.futures
import dataclasses
import os
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from .._declare.component import Component
from .._declare.node import leaves_of
from .._errors import ModelError, SimulationError
from .._integrate.options import count, flag, one_of
from ._certificate import UNKNOWN, Multipliers, curvature, multipliers_of, residual
from ._design import Active, Design, Result, Sensitivity, Status, Tried
from ._free import Free, Place, free_parameters
from ._limits import Limit, Objective, limits_of, objectives_of
from ._program import Evaluation, Program
from ._report import reporter
from ._search import FEASIBLE, Outcome, Trail, nearest_good, sample, search
from ._solve import Method
from ._task import Task, task_of

M = TypeVar("M", bound=Component)
METHODS: Mapping[str, Method] = {"SLSQP": "SLSQP", "trust-constr": "trust-constr"}
OPTIMAL = 1e-6  # the residual of the conditions of an optimum
SHARE = 1e-3  # of a conflict, below which a limit has no part in it


def optimise(
    model: M,
    free: Mapping[Any, Any],
    minimise: Any,
    *,
    run: Callable[[M], Any] | None = None,
    constraints: Mapping[str, Any] | None = None,
    scenarios: Mapping[str, Mapping[str, Any]] | None = None,
    start: Any = None,
    starts: int = 1,
    method: Method = "SLSQP",
    most: int = 200,
    sensitivities: bool = True,
    progress: bool | None = None,
) -> Design[M]:
    """Find the values of free parameters that minimise a result, and certify them.

        optimise(
            drive,
            {"gear.ratio": (2.0, 20.0), "spring.c": ("5 N.m/rad", "20 N.m/rad")},
            {"time": (lambda s: s.t1, "ms")},
            run=lambda m: simulate(m, 0.5, until=lambda s: s.load.b.phi - 0.8, save="end"),
            constraints={"final speed": (lambda s: s.final.load.w, "<= 100 rpm")},
        )

    - `free`: bounds by path; a tuple of paths shares one value, an element of an array is named as in `"table.y[3]"`.
    - `minimise`: a function of the run, with the unit to show it in if it is not a pure number, and with a name.
    - `run`: makes what the functions are given out of the model: a solution or any container of them; without it, the
      functions are given the model. With `scenarios`, changes of the model by path, as in `{"cold": {"oil.T": 253.0}}`,
      there is a run for each, and the functions are given a dictionary of them.
    - `constraints`: a function and its limit by name, "<= 60 A", ">= 1.2" or "== 3 bar"; a function that returns
      several numbers has its limit for each of them. A limit with a unit is converted to SI.
    - `start`: where to begin: values by path, a `Design` or the file of one, to resume; by default the model's values.
    - `starts`: how many starts; those after the first one are from Sobol's sequence between the bounds.
    - `method`: "SLSQP" or "trust-constr", both of scipy, with exact gradients. What they find is improved by Newton's
      method on the conditions of an optimum, whose residual is accurate to the runs: use `rtol=1e-9` or so.
    - `most`: iterations. `sensitivities`: whether to compute those of the optimum to all fixed parameters.
    - `progress`: whether to print a line for each iteration; by default on a terminal.

    A run that fails, or never meets its stop condition, is a design that the search steps back from, whatever its
    `throw` says. An interrupt from the keyboard ends the search with the best design so far.

    Raises `ModelError` for what is wrong with the problem, `ParameterError` for bounds, units and starts, and
    `SimulationError` where no design between the bounds can be computed.
    """
    began = time.perf_counter()
    problem = Problem.of(model, free, minimise, run, constraints, scenarios)
    one_of(method, "method", METHODS)
    first = start_of(problem.free, model, start)
    task = problem.task(first)
    found = search_all(task, first, count(starts, "starts"), method, count(most, "most"), progress, problem.objective)
    designs = [_design(problem, task, outcome, first) for outcome in found]
    best = min(designs, key=_rank)
    if flag(sensitivities, "sensitivities") and not best.conflict and best.status != "interrupted":
        best = dataclasses.replace(best, sensitivities=_sensitivities(problem, task, best))
    others = tuple(design for design in designs if design.objective is not best.objective)
    seconds = time.perf_counter() - began
    return dataclasses.replace(
        best, others=others, seconds=seconds, evaluations=task.program.evaluations,
        seconds_evaluating=task.program.seconds,
    )  # fmt: skip


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
        free: Mapping[Any, Any],
        minimise: Any,
        run: Callable[[Any], Any] | None,
        constraints: Mapping[str, Any] | None,
        scenarios: Mapping[str, Mapping[str, Any]] | None,
    ) -> "Problem":
        if not isinstance(model, Component):
            raise ModelError(f"{model!r} is no component: optimise a model.")
        objective, *more = objectives_of(minimise)
        if more:
            raise ModelError("optimise minimises one function; pareto takes several.")
        limits = limits_of(constraints)
        functions = {objective.name: objective.function, **{name: pair[0] for name, pair in limits.items()}}
        if len(functions) <= len(limits):
            raise ModelError(f"{objective.name} is the name of the objective and of a constraint. Rename one.")
        variables = free_parameters(model, free)
        program = Program(model, variables, functions, run, scenarios)
        return Problem(model, variables, objective, {name: pair[1] for name, pair in limits.items()}, program)

    def task(self, x: np.ndarray) -> Task:
        """The task, measured by what the results are at `x`, or next to it where these cannot be computed."""
        task = task_of(self.program, self.program(x), self.objective.name, self.limits)
        good = nearest_good(task, np.asarray(self.free.scaled(x)))
        return task_of(self.program, task.evaluation(good), self.objective.name, self.limits)


def start_of(free: Free, model: Component, start: Any) -> np.ndarray:
    """The values to start from: those of the model, changed by what is given."""
    if isinstance(start, str | Path):
        start = Design.load(start)
    given = start.values if isinstance(start, Design) else start
    x = free.values(model)
    if given is None:
        return x
    if not isinstance(given, Mapping):
        raise ModelError(f"start is a dictionary of values by path, a Design, or a file of one; got {start!r}.")
    return free.changed(x, given)


def search_all(
    task: Task, first: np.ndarray, starts: int, method: Method, most: int, progress: bool | None, objective: Objective
) -> list[Outcome]:
    """The ends of searches from `first` and from further starts, on all cores where there are several."""
    z = np.asarray(task.free.scaled(first))
    places = [z, *sample(task, starts - 1)] if starts > 1 else [z]
    trails = [Trail(said=reporter(task, objective, number, starts, progress)) for number in range(len(places))]
    if starts == 1:
        return [search(task, z, trails[0], method, most)]
    outcomes: list[Outcome] = []
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        pairs = zip(places, trails, strict=True)
        futures = [pool.submit(_searched, task, place, trail, method, most) for place, trail in pairs]
        try:
            concurrent.futures.wait(futures)
        except KeyboardInterrupt:
            for trail in trails:
                trail.stop.set()
        outcomes = [found for future in futures if (found := future.result()) is not None]
    if not outcomes:
        raise SimulationError("None of the starts led to a design that could be computed.")
    return outcomes


def _searched(task: Task, place: np.ndarray, trail: Trail, method: Method, most: int) -> Outcome | None:
    try:
        return search(task, place, trail, method, most)
    except (SimulationError, KeyboardInterrupt):
        return None


def _rank(design: Design[Any]) -> tuple[bool, float, float]:
    """Feasible designs first, by their objective."""
    broken = max((-result.margin for result in design.results), default=0.0)
    return broken > 10.0 * FEASIBLE, broken if broken > 10.0 * FEASIBLE else 0.0, design.objective


def _design(problem: Problem, task: Task, outcome: Outcome, start: np.ndarray) -> Design[Any]:
    found = task.evaluation(outcome.point.z)
    value = float(found.values[task.objective])
    # The certificate is about the objective in units of what it has become.
    own = dataclasses.replace(task, size=abs(value) if abs(value) > 1e-6 * task.size else task.size)
    point = own.point(outcome.point.z, found)
    multipliers = multipliers_of(point, own.bounds, own.is_equation)
    kkt = residual(point, multipliers, own.is_equation)
    is_end = not outcome.is_interrupted and outcome.conflict is None
    bent = curvature(own.at, point, multipliers) if is_end else UNKNOWN
    results = tuple(Result(limit, float(found.values[row])) for limit, row in zip(task.limits, task.rows, strict=True))
    trail = outcome.trail
    return Design(
        model=problem.free.with_values(problem.model, found.x),
        free=problem.free,
        x=found.x,
        start=start,
        status=_status(outcome, kkt, bent.verdict),
        objective_name=problem.objective.name,
        objective_scale=problem.objective.scale,
        objective=value,
        results=results,
        kkt_residual=kkt,
        active=tuple(_active(own, found, multipliers)),
        curvature=bent,
        conflict=_conflict(task, outcome),
        sensitivities=(),
        history=tuple(_tried(task, step) for step in trail.steps),
        failed=tuple(_tried(task, step) for step in trail.failed),
        evaluations=0,
        seconds=0.0,
        seconds_evaluating=0.0,
    )


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


def _tried(task: Task, found: Evaluation) -> Tried:
    return Tried(found.x, float(found.values[task.objective]), found.values[task.rows], found.why)


def _sensitivities(problem: Problem, task: Task, design: Design[Any]) -> tuple[Sensitivity, ...]:
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
