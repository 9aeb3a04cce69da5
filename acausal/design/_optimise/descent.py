"""Descent to a local minimum: a solver, Newton's method and steps away from saddle points."""

import itertools
from collections.abc import Callable

import numpy as np

from .._certificate.first_order import (
    FEASIBLE,
    NEAR,
    Bounds,
    Multipliers,
    Point,
    PointAt,
    multipliers_of,
    residual,
    violation,
)
from .._certificate.second_order import CLOSE, STEP, descent_steps, quadratic_of, slopes_along

ROUNDS = 8  # most Newton iterations, and most steps away from saddle points
CONTRACTION = 0.1  # required reduction of the residual per Newton iteration; otherwise no optimum is nearby
WAYS = 4  # most directions to try from a point
SHORTER = (1.0, 0.1, 0.01)  # shares of a step to try


def descended(
    at: PointAt,
    z: np.ndarray,
    bounds: Bounds,
    is_equation: np.ndarray,
    idle: Callable[[np.ndarray], np.ndarray],
    solver: Callable[[np.ndarray], np.ndarray],
) -> Point:
    """A local minimum from `z`, according to first and second derivatives.

    If the solver ends at a saddle point or too early, the search continues after a step along which the Lagrangian
    decreases, such as a direction of negative curvature. `idle` marks the variables without effect at a point.
    """

    def better(point: Point) -> Point | None:
        multipliers = multipliers_of(point, bounds, is_equation)
        quadratic = quadratic_of(at, point, multipliers, bounds, is_equation, idle(point.z))
        for step in itertools.islice(descent_steps(at, point, multipliers, quadratic, bounds), WAYS):
            start = _lower(at, point, multipliers, step, bounds)
            found = point if start is None else certain(at, solver(start.z))
            if _merit(found, is_equation) < _merit(point, is_equation):
                return found
        return None

    point = certain(at, solver(z))
    for _ in range(ROUNDS):
        if violation(point, is_equation) > FEASIBLE or (found := better(point)) is None:
            break
        point = found
    return point


def certain(at: PointAt, z: np.ndarray) -> Point:
    point = at(z)
    assert point is not None  # a solver ends at a point that it could compute
    return point


def _merit(point: Point, is_equation: np.ndarray) -> tuple[float, float]:
    return max(violation(point, is_equation) - FEASIBLE, 0.0), point.f


def _lower(at: PointAt, point: Point, multipliers: Multipliers, step: np.ndarray, bounds: Bounds) -> Point | None:
    """The end of a step, or of a shorter one, with a lower Lagrangian; None if there is none."""

    def lagrangian(point: Point) -> float:
        return point.f + float(multipliers.constraints @ point.c)

    for share in SHORTER:
        found = at(np.clip(point.z + share * step, *bounds))
        if found is not None and lagrangian(found) < lagrangian(point):
            return found
    return None


def polished(at: PointAt, z: np.ndarray, bounds: Bounds, is_equation: np.ndarray) -> np.ndarray:
    """Newton's method on the KKT conditions with the active constraints at `z`, as long as the residual decreases."""
    point = certain(at, z)
    before = residual(point, multipliers_of(point, bounds, is_equation), is_equation)
    for _ in range(ROUNDS):
        if before <= CLOSE:
            break
        target = _newton(at, point, multipliers_of(point, bounds, is_equation, NEAR), bounds, is_equation)
        found = None if target is None else at(target)
        if found is None:
            break
        after = residual(found, multipliers_of(found, bounds, is_equation), is_equation)
        if after > CONTRACTION * before:
            break
        point, before = found, after
    return point.z


def _newton(
    at: PointAt, point: Point, multipliers: Multipliers, bounds: Bounds, is_equation: np.ndarray
) -> np.ndarray | None:
    """Solution of the linearised KKT conditions with the active bounds attained; None if it is not nearby."""
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
    for column, variable in enumerate(moving.tolist()):
        slopes = slopes_along(at, here, multipliers, bounds, variable, reach=1)
        if len(slopes) == 1:
            return None
        first, last = min(slopes), max(slopes)
        hessian[:, column] = (slopes[last] - slopes[first])[moving] / ((last - first) * STEP)
    a = here.jacobian[active.constraints | is_equation][:, moving]
    system = np.block([[0.5 * (hessian + hessian.T), a.T], [a, np.zeros((len(a), len(a)))]])
    right = -np.concatenate([here.gradient[moving], here.c[active.constraints | is_equation]])
    step = np.linalg.lstsq(system, right, rcond=None)[0][: len(moving)]
    if not np.all(np.isfinite(step)) or np.max(np.abs(step)) > 0.1:
        return None
    z[moving] += step
    return np.clip(z, low, high)
