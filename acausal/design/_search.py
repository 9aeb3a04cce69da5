"""From a start to a local optimum, or to the design that comes closest to its limits."""

import dataclasses
import threading
import time
from collections.abc import Callable, Iterator

import numpy as np
from scipy.stats import qmc

from .._errors import SimulationError
from ._certificate import STEP, Multipliers, multipliers_of, residual, stationarity
from ._program import Evaluation
from ._solve import At, Method, solve
from ._task import Point, Task

PLACES = 64  # tried where the start cannot be computed
NEAR = 1e-3  # what is so close to a limit may be active, as long as the place is not accurate
CLOSE = 1e-9  # a residual that need not be improved
FEASIBLE = 1e-7  # of the size of a limit
ROUNDS = 8  # of Newton's method
CONTRACTION = 0.1  # share that a round has to reduce the residual to: else there is no optimum nearby


class Interrupted(Exception):
    """Somebody has asked the search to end."""


@dataclasses.dataclass
class Trail:
    """Where a search has been: the designs that its solver went through, and those that could not be computed."""

    steps: list[Evaluation] = dataclasses.field(default_factory=list)
    failed: list[Evaluation] = dataclasses.field(default_factory=list)
    stop: threading.Event = dataclasses.field(default_factory=threading.Event)
    said: Callable[[int, Evaluation], None] = lambda number, evaluation: None
    start: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(0))
    seen: set[bytes] = dataclasses.field(default_factory=set)
    seconds: float = 0.0

    @property
    def evaluations(self) -> int:
        return len(self.seen)

    def add(self, found: Evaluation) -> None:
        if not self.steps or not np.array_equal(self.steps[-1].x, found.x):
            self.steps.append(found)
            self.said(len(self.steps) - 1, found)


@dataclasses.dataclass
class Outcome:
    """The end of a search: its point and, where no design keeps all limits, the shares that those in conflict have."""

    point: Point
    trail: Trail
    is_interrupted: bool = False
    conflict: np.ndarray | None = None


def search(task: Task, start: np.ndarray, trail: Trail, method: Method, most: int) -> Outcome:
    """A local optimum from a scaled start."""

    def at(z: np.ndarray) -> Point | None:
        if trail.stop.is_set():
            raise Interrupted
        found = task.evaluation(z)
        trail.seen.add(found.x.tobytes())
        if found.is_good:
            return task.point(z, found)
        if not any(np.array_equal(found.x, other.x) for other in trail.failed):
            trail.failed.append(found)
        return None

    began, trail.start = time.perf_counter(), np.array(start)
    try:
        at(start)
        return _search(task, at, nearest_good(task, start), trail, method, most)
    except (KeyboardInterrupt, Interrupted):
        trail.stop.set()
        best = _best(task, trail)
        if best is None:
            raise
        return Outcome(best, trail, is_interrupted=True)
    finally:
        trail.seconds = time.perf_counter() - began


def _search(task: Task, at: At, z: np.ndarray, trail: Trail, method: Method, most: int) -> Outcome:
    def watch(z: np.ndarray) -> None:
        found = task.evaluation(z)
        if found.is_good:
            trail.add(found)

    def solved(z: np.ndarray) -> Point:
        watch(z)
        z = solve(at, z, task.bounds, task.is_equation, method=method, most=most, watch=watch)
        point = _certain(at, polished(at, z, task.bounds, task.is_equation))
        watch(point.z)
        return point

    def is_feasible(point: Point) -> bool:
        return task.violation(point) <= FEASIBLE

    point = solved(z)
    if is_feasible(point):
        return Outcome(point, trail)
    # A solver may have strayed to where little can be computed: what matters is how close it came on the way.
    closest, shares = _best(task, trail) or point, None
    if not is_feasible(closest):
        nearest, shares = _least_infeasible(task, at, closest, most)
        watch(nearest.z)
        if not is_feasible(nearest):
            return Outcome(min(nearest, closest, key=task.violation), trail, conflict=shares)
        closest = nearest
    point = solved(closest.z)
    return Outcome(point if is_feasible(point) else closest, trail)


def nearest_good(task: Task, start: np.ndarray) -> np.ndarray:
    """The start, or the nearest place of a sample where all can be computed."""
    if task.at(start) is not None:
        return start
    for z in sorted(sample(task, PLACES), key=lambda z: float(np.linalg.norm(z - start))):
        if task.at(z) is not None:
            return z
    raise SimulationError(
        f"Neither the start nor any of {PLACES} designs between the bounds could be computed. At the start: "
        f"{task.evaluation(start).why}. Start from a design that works, or move the bounds."
    )


def sample(task: Task, n: int) -> Iterator[np.ndarray]:
    """Places that fill the space between the bounds: Sobol's sequence, scrambled always alike."""
    low, high = task.bounds
    low, high = np.where(np.isfinite(low), low, -1.0), np.where(np.isfinite(high), high, 1.0)
    points = qmc.Sobol(len(low), rng=0).random_base2(max(n - 1, 0).bit_length())[:n]
    yield from low + points * (high - low)


def _certain(at: At, z: np.ndarray) -> Point:
    point = at(z)
    assert point is not None  # a solver ends where it could compute
    return point


def _best(task: Task, trail: Trail) -> Point | None:
    """The best design so far: of those that keep the limits, else the one that breaks them least."""
    points = [task.point(np.asarray(task.free.scaled(found.x)), found) for found in trail.steps]
    ranked = [(max(task.violation(point) - FEASIBLE, 0.0), point.f, i) for i, point in enumerate(points)]
    return points[min(ranked)[2]] if ranked else None


def polished(at: At, z: np.ndarray, bounds: tuple[np.ndarray, np.ndarray], is_equation: np.ndarray) -> np.ndarray:
    """Newton's method on the conditions of an optimum, with what is active at `z`, as long as the residual falls."""
    point = _certain(at, z)
    before = residual(point, multipliers_of(point, bounds, is_equation), is_equation)
    for _ in range(ROUNDS):
        if before <= CLOSE:
            break
        target = _newton(at, point, multipliers_of(point, bounds, is_equation, NEAR), bounds)
        found = None if target is None else at(target)
        if found is None:
            break
        after = residual(found, multipliers_of(found, bounds, is_equation), is_equation)
        if after > CONTRACTION * before:
            break
        point, before = found, after
    return point.z


def _newton(at: At, point: Point, multipliers: Multipliers, bounds: tuple[np.ndarray, np.ndarray]) -> np.ndarray | None:
    """Where the conditions are met that are linearised with active bounds reached; None where no such place is near."""
    active = multipliers.active()
    low, high = bounds
    z = np.where(active.lower, low, np.where(active.upper, high, point.z))
    moving = np.flatnonzero(~(active.lower | active.upper))
    here = at(z)
    if here is None:
        return None
    if not len(moving):
        return z
    hessian = np.zeros((len(moving), len(moving)))
    for column, variable in enumerate(moving):
        sides = [at(z + sign * STEP * np.eye(len(z))[variable]) for sign in (1.0, -1.0)]
        if sides[0] is None or sides[1] is None:
            return None
        slopes = [stationarity(side, multipliers)[moving] for side in sides if side is not None]
        hessian[:, column] = (slopes[0] - slopes[1]) / (2.0 * STEP)
    a = here.jacobian[active.constraints][:, moving]
    system = np.block([[0.5 * (hessian + hessian.T), a.T], [a, np.zeros((len(a), len(a)))]])
    right = -np.concatenate([here.gradient[moving], here.c[active.constraints]])
    step = np.linalg.lstsq(system, right, rcond=None)[0][: len(moving)]
    if not np.all(np.isfinite(step)) or np.max(np.abs(step)) > 0.1:
        return None
    z[moving] += step
    return np.clip(z, low, high)


def _least_infeasible(task: Task, at: At, point: Point, most: int) -> tuple[Point, np.ndarray | None]:
    """The design whose largest violation t is least, min t with c <= t, and the multipliers of the limits there.

    These sum to one: they are the shares that the limits have in the conflict. None where the conditions of that
    optimum are not met, so that a conflict is not proven.
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
    end = polished(elastic, solve(elastic, start, bounds, none, most=most), bounds, none)
    found = _certain(elastic, end)
    multipliers = multipliers_of(found, bounds, none, NEAR)
    if residual(found, multipliers, none) > NEAR:
        return _certain(at, end[:n]), None
    shares = multipliers.constraints
    both = shares[: len(point.c)].copy()
    both[is_equation] += shares[len(point.c) :]
    return _certain(at, end[:n]), both
