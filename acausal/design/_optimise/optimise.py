"""`optimise`: free parameters that minimise a result of a model subject to limits of other results."""

import dataclasses
import os
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from ..._declare.component import Component
from ..._errors import DesignWarning, ModelError, SimulationError, reason_of
from ..._integrate.setup.options import count, flag, one_of
from .._certificate.first_order import FEASIBLE
from .._compute.cores import threads, wait_for
from .._problem.limits import Objective, objectives_of
from .._problem.types import ByPath
from .certified import certified, sensitivities_of
from .design import Design
from .design_problem import DesignProblem, starts_of
from .local_search import SearchResult, Trail, interrupted, sample, search
from .report import ProgressReport, reporter
from .solve import Method
from .task import Task

M = TypeVar("M", bound=Component)
METHODS: Mapping[str, Method] = {"SLSQP": "SLSQP", "trust-constr": "trust-constr"}


def optimise(
    model: M,
    free: ByPath[object],
    minimise: object,
    *,
    run: Callable[[M], Any] | None = None,
    constraints: Mapping[str, object] | None = None,
    scenarios: Mapping[str, Mapping[str, object]] | None = None,
    start: object = None,
    starts: int = 1,
    method: Method = "SLSQP",
    most: int = 200,
    sensitivities: bool = True,
    progress: bool | None = None,
) -> Design[M]:
    """Finds the values of free parameters that minimise a result, and certifies the optimum.

        optimise(
            drive,
            {"gear.ratio": (2.0, 20.0), "spring.c": ("5 N.m/rad", "20 N.m/rad")},
            {"time": (lambda s: s.t1, "ms")},
            run=lambda m: simulate(m, 0.5, until=lambda s: s.load.b.phi - 0.8, save="end"),
            constraints={"final speed": (lambda s: s.final.load.w, "<= 100 rpm")},
        )

    - `free`: bounds by path. A tuple of paths shares one value; `"table.y[3]"` is an element of an array.
    - `minimise`: a function of the run, with its display unit unless it is a pure number, and with a name.
    - `run`: a function of the model that returns the argument of the other functions, a solution or a container of
      several; by default the model. `scenarios` are changes of the model by path, as in `{"cold": {"oil.T": 253.0}}`:
      each has its run, and the functions take a dictionary of runs.
    - `constraints`: a function and its limit by name: "<= 60 A", ">= 1.2" or "== 3 bar". The limit applies to each
      number that the function returns. A limit with a unit is converted to SI.
    - `start`: values by path, a `Design` or its file, to resume, or a list of these; by default the model's values.
    - `starts`: number of starts. Those not given come from a Sobol sequence between the bounds.
    - `method`: "SLSQP" or "trust-constr" of scipy, with exact gradients. Newton's method on the KKT conditions refines
      the result. The residual is as accurate as the runs: use `rtol=1e-9` or so.
    - `most`: most iterations. `sensitivities`: whether to compute those of the optimum to all fixed parameters.
    - `progress`: whether to print a line for each iteration; by default on a terminal, and every second in logs.
      Unless it is False, the search also reports long compilations, the first failures and, every ten seconds, the
      number of designs.

    If a run fails or never meets its stop condition, the search steps back, whatever the `throw` of the run. It stops
    if the start and four designs spread between the bounds fail for the same reason. A keyboard interrupt ends the
    search with the best design so far.

    Raises `ModelError` for an invalid problem, `ParameterError` for bounds, units and starts, and `SimulationError` if
    no design between the bounds can be computed.
    """
    objective, *more = objectives_of(minimise)
    if more:
        raise ModelError("optimise minimises one function; pareto takes two.")
    problem = DesignProblem.of(model, free, [objective], run, constraints, scenarios, progress)
    one_of(method, "method", METHODS)
    return best_design(problem, start, count(starts, "starts"), method, most, sensitivities, progress)


def best_design(
    problem: DesignProblem,
    start: object,
    starts: int,
    method: Method = "SLSQP",
    most: int = 200,
    sensitivities: bool = True,
    progress: bool | None = None,
) -> Design[Any]:
    """The best certified design of the searches from all starts; the arguments are those of `optimise`."""
    began, before = time.perf_counter(), problem.evaluator.evaluations
    problem.evaluator.watch = ProgressReport(problem.evaluator, progress)
    places = starts_of(problem.free, problem.model, start)
    task = problem.task(places[0])
    number = max(starts, len(places))
    found = search_all(task, places, number, method, count(most, "most"), progress, problem.objective)
    designs = sorted((certified_or_kept(problem, outcome) for outcome in found), key=_rank)
    best = designs[0]
    if flag(sensitivities, "sensitivities") and not best.conflict and best.status != "interrupted":
        try:
            best = dataclasses.replace(best, sensitivities=sensitivities_of(problem, task, best))
        except (KeyboardInterrupt, Exception) as error:
            warnings.warn(f"The design has no sensitivities: {reason_of(error)}", DesignWarning, stacklevel=3)
    return dataclasses.replace(
        best,
        others=tuple(designs[1:]),
        total_evaluations=task.evaluator.evaluations - before,
        total_seconds=time.perf_counter() - began,
        seconds_evaluating=task.evaluator.seconds,
    )


def certified_or_kept(problem: DesignProblem, outcome: SearchResult) -> Design[Any]:
    """A design with its certificate, or an interrupted one if the certificate cannot be computed."""
    try:
        return certified(problem, outcome)
    except (KeyboardInterrupt, Exception) as error:
        warnings.warn(f"A design has no certificate: {reason_of(error)}", DesignWarning, stacklevel=4)
        return certified(problem, dataclasses.replace(outcome, is_interrupted=True))


def search_all(
    task: Task,
    given: Sequence[np.ndarray],
    starts: int,
    method: Method,
    most: int,
    progress: bool | None,
    objective: Objective,
) -> list[SearchResult]:
    """Results of the searches from the given and further starts, on all cores."""
    own = [np.asarray(task.free.scaled(x)) for x in given]
    places = [*own, *sample(task, starts - len(own))]
    trails = [Trail(report=reporter(task, objective, number, starts, progress)) for number in range(len(places))]
    if starts == 1:
        return [search(task, places[0], trails[0], method, most)]
    with threads(os.cpu_count() or 1) as pool:
        pairs = zip(places, trails, strict=True)
        futures = {pool.submit(_searched, task, place, trail, method, most): trail for place, trail in pairs}
        try:
            wait_for(futures)
            ends = [future.result() for future in futures]
        except KeyboardInterrupt:
            # A search that still runs ends with its best design, without waiting for its next one.
            pairs = futures.items()
            ends = [future.result() if future.done() else interrupted(task, trail) for future, trail in pairs]
            if not any(isinstance(end, SearchResult) for end in ends):
                raise
    outcomes = [end for end in ends if isinstance(end, SearchResult)]
    for error in (end for end in ends if isinstance(end, Exception) and not isinstance(end, SimulationError)):
        if not outcomes:
            raise error
        warnings.warn(f"A search ended without a design: {reason_of(error)}", DesignWarning, stacklevel=4)
    if not outcomes:
        raise SimulationError("No start led to a design that could be computed.")
    return outcomes


def _searched(task: Task, place: np.ndarray, trail: Trail, method: Method, most: int) -> SearchResult | BaseException:
    """The result of a search, or the error that ended it without a design."""
    try:
        return search(task, place, trail, method, most)
    except (KeyboardInterrupt, Exception) as error:
        return error


def _rank(design: Design[Any]) -> tuple[bool, float, float]:
    """Feasible designs first, by their objective."""
    broken = max((-result.margin for result in design.results), default=0.0)
    return broken > 10.0 * FEASIBLE, broken if broken > 10.0 * FEASIBLE else 0.0, design.objective
