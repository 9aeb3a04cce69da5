"""Minimum of a function of one positive number, from its slope, where the function may be infinite."""

import dataclasses
import math
from collections.abc import Callable

LONGEST_STEP = math.log(2.0)  # of log(x), while the minimum is not enclosed
RETREATS = 6  # factors of two that are tried on either side of a start of infinite value


@dataclasses.dataclass(frozen=True)
class Point:
    """A place where the function was evaluated."""

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
    """The search has not come to an end."""


def minimise(
    evaluate: Callable[[float], tuple[float, float]], start: float, *, tolerance: float = 1e-6, most: int = 60
) -> list[Point]:
    """The path to a local minimum of f over x > 0; its last point is the minimum, to the relative `tolerance` in x.

    `evaluate(x)` gives f and df/dx. The zero of df/dlog(x) is searched by secants between two bounds: the slope tells
    on which side of a point the minimum is, and from a point of infinite f the search steps back.

    The line searches of scipy and optimistix do not start where f is infinite, take several evaluations a step and do
    not enclose the minimum; a bracketing root finder has to be given an enclosure that is finite all through.
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
    raise NoMinimumError(f"{most} evaluations from {start:g} on did not lead to a minimum; the last was at {path[-1]}.")


def _until_finite(evaluate: Callable[[float], tuple[float, float]], start: float) -> list[Point]:
    """The start, and, while the value is infinite, places ever farther from it on both sides in turn."""
    path: list[Point] = []
    for factor in (2.0 ** (sign * k) for k in range(RETREATS + 1) for sign in ((1, -1) if k else (1,))):
        path.append(Point(factor * start, *evaluate(factor * start)))
        if path[-1].is_finite:
            return path
    raise NoMinimumError(f"The value is infinite at {start:g} and up to {2**RETREATS} times above and below it.")


def _step(finite: list[Point]) -> float:
    """The step of log(x) to where the slope should vanish."""
    last = finite[-1]
    step = -last.log_slope / (abs(last.value) or 1.0)  # as for a curvature of log(f) over log(x) of one
    if len(finite) > 1:
        curvature = (last.log_slope - finite[-2].log_slope) / (last.log_x - finite[-2].log_x)
        step = -last.log_slope / curvature if curvature > 0.0 else math.copysign(math.inf, step)
    return max(-LONGEST_STEP, min(step, LONGEST_STEP))


def _bounds(path: list[Point], here: Point) -> tuple[float, float]:
    """The nearest places below and above, of log(x), between which the minimum must be."""
    below = [p.log_x for p in path if p.x <= here.x and (p.slope < 0.0 or not p.is_finite)]
    above = [p.log_x for p in path if p.x >= here.x and (p.slope > 0.0 or not p.is_finite)]
    return max(below, default=-math.inf), min(above, default=math.inf)
