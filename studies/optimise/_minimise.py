"""Minimisation over one positive variable with derivatives. The function may be infinite in places."""

import dataclasses
import math
from collections.abc import Callable

LONGEST_STEP = math.log(2.0)  # of log(x), until the minimum is bracketed
RETREATS = 6  # number of factors of two to try on either side of an infinite start


@dataclasses.dataclass(frozen=True)
class Point:
    """An evaluation of the function."""

    x: float
    value: float
    slope: float  # dvalue/dx

    @property
    def is_finite(self) -> bool:
        return math.isfinite(self.value)

    @property
    def log_x(self) -> float:
        return math.log(self.x)

    @property
    def log_slope(self) -> float:
        """dvalue/dlog(x)."""
        return self.x * self.slope


class NoMinimumError(Exception):
    """The search found no minimum."""


def minimise(
    evaluate: Callable[[float], tuple[float, float]], start: float, *, tolerance: float = 1e-6, most: int = 60
) -> list[Point]:
    """Returns the path to a local minimum of f over x > 0. Its last point is the minimum, to the relative `tolerance`.

    `evaluate(x)` returns f and df/dx. A bracketed secant search finds the zero of df/dlog(x). The sign of the slope
    updates the bracket, and the search steps back from points where f is infinite.

    Library routines do not fit: the line searches of scipy and optimistix cannot start where f is infinite, need
    several evaluations per step and do not bracket the minimum, and bracketing root finders need an initial bracket in
    which f is finite.
    """
    path = _until_finite(evaluate, start)
    while len(path) < most:
        finite = [point for point in path if point.is_finite]
        here, target = finite[-1], finite[-1].log_x + _step(finite)
        low, high = _bounds(path, here)
        if not (path[-1].is_finite and low < target < high):
            target = 0.5 * (low + high)
        if abs(target - here.log_x) <= tolerance:
            return path
        x = math.exp(target)
        path.append(Point(x, *evaluate(x)))
    raise NoMinimumError(f"{most} evaluations, starting at {start:g}, found no minimum; the last was {path[-1]}.")


def _until_finite(evaluate: Callable[[float], tuple[float, float]], start: float) -> list[Point]:
    """Evaluates the start and, while the value is infinite, points at increasing distance on alternating sides."""
    path: list[Point] = []
    for factor in (2.0 ** (sign * k) for k in range(RETREATS + 1) for sign in ((1, -1) if k else (1,))):
        path.append(Point(factor * start, *evaluate(factor * start)))
        if path[-1].is_finite:
            return path
    raise NoMinimumError(f"The value is infinite at {start:g} and up to {2**RETREATS} times above and below it.")


def _step(finite: list[Point]) -> float:
    """The secant step in log(x) to the zero of the slope."""
    last = finite[-1]
    step = -last.log_slope / (abs(last.value) or 1.0)  # assumes d2 log(f) / d log(x)2 = 1
    if len(finite) > 1:
        curvature = (last.log_slope - finite[-2].log_slope) / (last.log_x - finite[-2].log_x)
        step = -last.log_slope / curvature if curvature > 0.0 else math.copysign(math.inf, step)
    return max(-LONGEST_STEP, min(step, LONGEST_STEP))


def _bounds(path: list[Point], here: Point) -> tuple[float, float]:
    """The bracket of the minimum in log(x): the nearest points below and above."""
    below = [p.log_x for p in path if p.x <= here.x and (p.slope < 0.0 or not p.is_finite)]
    above = [p.log_x for p in path if p.x >= here.x and (p.slope > 0.0 or not p.is_finite)]
    return max(below, default=-math.inf), min(above, default=math.inf)
