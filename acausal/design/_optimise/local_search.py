"""Search from a start for a local optimum, or for the design with the smallest violation."""

import dataclasses
import threading
import time
import warnings
from collections.abc import Callable, Iterator

import numpy as np
from scipy.stats import qmc

from ..._errors import DesignWarning, SimulationError, reason_of
from .._certificate.first_order import FEASIBLE, NEAR, Point, PointAt, multipliers_of, residual
from .._compute.evaluator import Evaluation
from .descent import certain, descended, polished
from .solve import Method, solve
from .task import Task

PLACES = 64  # most points to try if the start cannot be computed
ALIKE = 5  # designs that fail for the same reason before the search gives up
RESIZED = 3  # most searches with larger sizes of variables without bounds


class Interrupted(Exception):
    """Ends a search on request."""


@dataclasses.dataclass
class Trail:
    """History of a search: the iterates of its solver, and the designs that could not be computed."""

    steps: list[Evaluation] = dataclasses.field(default_factory=list)
    failed: list[Evaluation] = dataclasses.field(default_factory=list)
    stop: threading.Event = dataclasses.field(default_factory=threading.Event)
    report: Callable[[int, Evaluation], None] = lambda number, evaluation: None
    start: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(0))
    evaluated: set[bytes] = dataclasses.field(default_factory=set)
    seconds: float = 0.0

    @property
    def evaluations(self) -> int:
        return len(self.evaluated)

    def add(self, found: Evaluation) -> None:
        if not self.steps or not np.array_equal(self.steps[-1].x, found.x):
            self.steps.append(found)
            self.report(len(self.steps) - 1, found)


@dataclasses.dataclass
class SearchResult:
    """The end of a search: its point in the scales of its task and, if infeasible, the shares of limits in conflict."""

    task: Task
    point: Point
    trail: Trail
    is_interrupted: bool = False
    conflict: np.ndarray | None = None


def search(task: Task, start: np.ndarray, trail: Trail, method: Method, most: int) -> SearchResult:
    """A local optimum from a scaled start."""
    began, trail.start = time.perf_counter(), np.asarray(task.free.unscaled(start))
    try:
        _recorded(task, trail)(start)
        z = nearest_good(task, start)
        outcome = _search(task, _recorded(task, trail), z, trail, method, most)
        for _ in range(RESIZED):
            larger = None if outcome.conflict is not None else task.with_size_of_steps(outcome.point)
            if larger is None:
                break
            task, z = larger, np.asarray(larger.free.scaled(task.evaluation(outcome.point.z).x))
            outcome = _search(task, _recorded(task, trail), z, trail, method, most)
        return outcome
    except (KeyboardInterrupt, Exception) as error:
        outcome = interrupted(task, trail)
        if outcome is None:
            raise
        if not isinstance(error, KeyboardInterrupt | Interrupted):
            text = f"A search ended early, with its best design so far: {reason_of(error)}"
            warnings.warn(text, DesignWarning, stacklevel=2)
        return outcome
    finally:
        trail.seconds = time.perf_counter() - began


def interrupted(task: Task, trail: Trail) -> SearchResult | None:
    """Ends a search with its best design; None if there is none."""
    trail.stop.set()
    best = _best(task, trail)
    return None if best is None else SearchResult(task, best, trail, is_interrupted=True)


def _recorded(task: Task, trail: Trail) -> PointAt:
    """Points of a task, recorded in the trail."""

    def at(z: np.ndarray) -> Point | None:
        if trail.stop.is_set():
            raise Interrupted
        found = task.evaluation(z)
        trail.evaluated.add(found.x.tobytes())
        if found.is_good:
            return task.point(z, found)
        if not any(np.array_equal(found.x, other.x) for other in trail.failed):
            trail.failed.append(found)
        return None

    return at


def _search(task: Task, at: PointAt, z: np.ndarray, trail: Trail, method: Method, most: int) -> SearchResult:
    def watch(z: np.ndarray) -> None:
        found = task.evaluation(z)
        if found.is_good:
            trail.add(found)

    def solver(z: np.ndarray) -> np.ndarray:
        watch(z)
        z = solve(at, z, task.bounds, task.is_equation, method=method, most=most, watch=watch)
        return polished(at, z, task.bounds, task.is_equation)

    def solved(z: np.ndarray) -> Point:
        point = descended(at, z, task.bounds, task.is_equation, task.idle, solver)
        watch(point.z)
        return point

    def is_feasible(point: Point) -> bool:
        return task.violation(point) <= FEASIBLE

    point = solved(z)
    if is_feasible(point):
        return SearchResult(task, point, trail)
    # The solver may have strayed to failing designs, so the search continues from its best iterate.
    closest, shares = _best(task, trail) or point, None
    if not is_feasible(closest):
        nearest, shares = _least_infeasible(task, at, closest, most)
        watch(nearest.z)
        if not is_feasible(nearest):
            return SearchResult(task, min(nearest, closest, key=task.violation), trail, conflict=shares)
        closest = nearest
    point = solved(closest.z)
    return SearchResult(task, point if is_feasible(point) else closest, trail)


def nearest_good(task: Task, start: np.ndarray) -> np.ndarray:
    """The start, or the nearest point of a sample that can be computed."""
    if task.at(start) is not None:
        return start
    places = list(sample(task, PLACES))
    reasons = [task.evaluation(z).why for z in (start, *places[: ALIKE - 1])]
    if len(set(reasons)) == 1:
        raise SimulationError(
            f"The start and {ALIKE - 1} designs spread between the bounds all fail alike: {reasons[0]}. Start from a "
            "design that works, or change what they have in common, such as the options of the run."
        )
    for z in sorted(places, key=lambda z: float(np.linalg.norm(z - start))):
        if task.at(z) is not None:
            return z
    raise SimulationError(
        f"Neither the start nor any of {PLACES} designs between the bounds could be computed. At the start: "
        f"{task.evaluation(start).why}. Start from a design that works, or move the bounds."
    )


def sample(task: Task, n: int) -> Iterator[np.ndarray]:
    """Points of a Sobol sequence between the bounds, scrambled with a fixed seed."""
    low, high = task.bounds
    low, high = np.where(np.isfinite(low), low, -1.0), np.where(np.isfinite(high), high, 1.0)
    points = qmc.Sobol(len(low), rng=0).random_base2(max(n - 1, 0).bit_length())[:n]
    yield from low + points * (high - low)


def _best(task: Task, trail: Trail) -> Point | None:
    """The best feasible design so far, otherwise the one with the smallest violation."""
    points = [task.point(np.asarray(task.free.scaled(found.x)), found) for found in trail.steps]
    ranked = [(max(task.violation(point) - FEASIBLE, 0.0), point.f, i) for i, point in enumerate(points)]
    return points[min(ranked)[2]] if ranked else None


def _least_infeasible(task: Task, at: PointAt, point: Point, most: int) -> tuple[Point, np.ndarray | None]:
    """The design with the smallest maximum violation, min t with c <= t, and the multipliers of its limits.

    The multipliers sum to one and are the shares of the limits in the conflict. They are None if the KKT conditions do
    not hold, because the conflict is then not proven.
    """
    is_equation = task.is_equation
    n = len(point.z)

    def elastic(extended: np.ndarray) -> Point | None:
        inner = at(extended[:n])
        if inner is None:
            return None
        t, down = extended[n], inner.c[is_equation]
        c = np.concatenate([inner.c, -down]) - t
        jacobian = np.concatenate([inner.jacobian, -inner.jacobian[is_equation]])
        whole = np.concatenate([jacobian, -np.ones((len(c), 1))], axis=1)
        return Point(np.array(extended), float(t), np.eye(n + 1)[n], c, whole)

    low, high = task.bounds
    bounds = np.append(low, 0.0), np.append(high, np.inf)
    none = np.zeros(len(point.c) + int(np.sum(is_equation)), bool)
    start = np.append(point.z, task.violation(point))
    found = descended(
        elastic, start, bounds, none,
        idle=lambda z: np.append(task.idle(z[:n]), False),
        solver=lambda z: polished(elastic, solve(elastic, z, bounds, none, most=most), bounds, none),
    )  # fmt: skip
    end = found.z
    multipliers = multipliers_of(found, bounds, none, NEAR)
    if residual(found, multipliers, none) > NEAR:
        return certain(at, end[:n]), None
    shares = multipliers.constraints
    both = shares[: len(point.c)].copy()
    both[is_equation] += shares[len(point.c) :]
    return certain(at, end[:n]), both
