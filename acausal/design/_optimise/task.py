"""A problem in scaled numbers: variables from 0 to 1, objective and constraints relative to their sizes.

The size of the objective is its largest slope over the range of a variable (gradient-based scaling), and its zero is
its value at the start. So the unit of the objective and a constant in it do not matter.
"""

import dataclasses
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import qmc

from ..._errors import ModelError
from .._certificate.first_order import FEASIBLE, OPTIMAL, Point, violation
from .._compute.evaluator import CHANGED, Evaluation, Evaluator
from .._problem.free import Free
from .._problem.limits import Limit

ROUNDING = 1e-12  # distance of a scaled variable from its bound that counts as zero
DEEP = 1e6  # decrease of the objective, in its sizes, that counts as unbounded
MANY = 10.0  # displacement of a variable without bounds, in its sizes, that requires a larger size
FAR = 1e3  # displacement of a variable without bounds, in its sizes, that counts as infinite
FALLING = 1e-3  # relative decrease of the objective for a doubled variable that counts as descent
BESIDE = 1e-2  # scaled distance of the second point that measures the objective
STRAIGHT = 0.1  # relative change of a slope below which a result is linear
DECADES = range(0, 16, 3)  # trial factors of sizes; those between are tried once a slope changes


class WithoutSlopes(NamedTuple):
    """Variables with zero derivatives: the `idle` ones without effect, and a design with other values for each of the
    others.
    """

    idle: np.ndarray
    jumps: Mapping[int, Evaluation]


@dataclasses.dataclass
class Task:
    """Minimisation of one result of an evaluator subject to limits of others.

    `rows` are the rows of the limited results. The scaled objective is its difference from `zero`, divided by `size`.
    `within` replaces the bounds of the scaled variables.
    """

    evaluator: Evaluator
    free: Free
    objective: int
    rows: np.ndarray
    limits: Sequence[Limit]
    size: float = 1.0
    zero: float = 0.0
    within: tuple[np.ndarray, np.ndarray] | None = None

    @property
    def is_equation(self) -> np.ndarray:
        return np.array([limit.is_equation for limit in self.limits], bool)

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Bounds of the scaled variables; infinite if there are none."""
        free = self.free
        return self.within or (np.asarray(free.scaled(free.low)), np.asarray(free.scaled(free.high)))

    def evaluation(self, z: np.ndarray) -> Evaluation:
        x = np.array(self.free.unscaled(z))
        for bound in (self.free.low, self.free.high):
            x = np.where(np.abs(z - np.asarray(self.free.scaled(bound))) < ROUNDING, bound, x)
        return self.evaluator(x)

    def at(self, z: np.ndarray) -> Point | None:
        """The point at `z`; None if it cannot be computed."""
        found = self.evaluation(z)
        return self.point(z, found) if found.is_good else None

    def point(self, z: np.ndarray, found: Evaluation) -> Point:
        slopes = np.asarray(self.free.slopes(found.x))
        sign = np.array([limit.sign / limit.size for limit in self.limits])
        excess = [limit.constraint(found.values[row]) for limit, row in zip(self.limits, self.rows, strict=True)]
        return Point(
            np.array(z, float),
            float((found.values[self.objective] - self.zero) / self.size),
            found.jacobian[self.objective] * slopes / self.size,
            np.array(excess, float),
            sign[:, None] * found.jacobian[self.rows] * slopes,
        )

    def idle(self, z: np.ndarray) -> np.ndarray:
        """Marks variables without effect: zero derivatives and equal values at all evaluated and at trial points."""
        return self.without_slopes(z).idle

    def without_slopes(self, z: np.ndarray) -> WithoutSlopes:
        """Variables with zero derivatives of objective and limits at all evaluated points and at trial points: one
        inside the bounds, and both ends.
        """
        rows, own = [self.objective, *self.rows], np.eye(len(z), dtype=bool)
        maybe = self.evaluator.idle(rows)
        if not np.any(maybe):
            return WithoutSlopes(maybe, {})
        low, high = self.bounds
        low, high = np.where(np.isfinite(low), low, z - 1.0), np.where(np.isfinite(high), high, z + 1.0)
        places = (low + qmc.Sobol(len(z), rng=0).random_base2(1)[1] * (high - low), low, high)

        def trials(moved: np.ndarray) -> list[Evaluation]:
            found = [self.evaluation(np.where(moved, place, z)) for place in places]
            return [trial for trial in found if trial.is_good]

        def differing(moved: np.ndarray) -> Evaluation | None:
            return next((trial for trial in trials(moved) if np.any(self.are_changes(here, trial))), None)

        here, together = self.evaluation(z), trials(maybe)
        maybe = self.evaluator.idle(rows) & bool(together)
        other = differing(maybe) if np.any(maybe) else None
        if other is None:
            return WithoutSlopes(maybe, {})
        each = {i: differing(own[i]) for i in np.flatnonzero(maybe).tolist()}
        jumps = {i: trial for i, trial in each.items() if trial is not None} or dict.fromkeys(each, other)
        return WithoutSlopes(maybe & ~np.isin(np.arange(len(z)), list(jumps)), jumps)

    def are_changes(self, here: Evaluation, there: Evaluation) -> np.ndarray:
        """Marks objective and limits whose values differ by more than the errors of runs."""
        size = np.zeros(len(here.values)) + np.inf
        size[self.objective] = self.size
        size[self.rows] = [limit.size for limit in self.limits]
        largest = np.maximum(np.abs(here.values), np.abs(there.values))
        return np.abs(there.values - here.values) > np.maximum(CHANGED * largest, OPTIMAL * size)

    def violation(self, point: Point) -> float:
        """The largest constraint violation."""
        return violation(point, self.is_equation)

    def with_size_of_steps(self, point: Point) -> "Task | None":
        """The task with larger sizes of variables without bounds that moved by many sizes; None if no variable did."""
        moved = [(group, float(np.max(np.abs(point.z[group])))) for group in self.free.open_groups]
        sizes = {i: self.free.variables[i].size * steps for group, steps in moved if steps > MANY for i in group}
        if not sizes or self.is_unbounded(point):
            return None
        larger = dataclasses.replace(self, free=self.free.with_sizes(sizes))
        return larger.measured(self.evaluation(point.z))

    def measured(self, found: Evaluation) -> "Task":
        """The task with the objective scaled by its slopes at a design and at a second point inside the bounds, since
        the slopes can vanish at an optimum. The size is zero if there is no slope.
        """
        z = np.asarray(self.free.scaled(found.x))
        beside = self.evaluation(z + np.where(z + BESIDE <= self.bounds[1], BESIDE, -BESIDE))
        slopes = [
            np.max(np.abs(one.jacobian[self.objective] * np.asarray(self.free.slopes(one.x))))
            for one in (found, beside)
            if one.is_good
        ]
        size = float(max(slopes)) or (0.0 if beside.is_good else 1.0)
        return dataclasses.replace(self, zero=float(found.values[self.objective]), size=size)

    def is_unbounded(self, point: Point) -> bool:
        """Whether a feasible point is far away and the objective still decreases there."""
        if self.violation(point) > FEASIBLE:
            return False
        is_far = self.free.is_open & (np.abs(point.z) > FAR)
        return point.f < -DEEP or bool(np.any(is_far & (point.gradient * point.z < -FALLING * abs(point.f))))


def task_of(evaluator: Evaluator, first: Evaluation, objective: str, limits: Mapping[str, Limit]) -> Task:
    """The task of minimising one of the functions of an evaluator, given its first evaluation.

    A limit applies to each of the numbers that its function returns.
    """
    names, owners = evaluator.names, evaluator.owners
    if (returned := owners.count(objective)) != 1:
        raise ModelError(f"{objective} must return one number, but returned {returned}.")
    row = owners.index(objective)
    rows = [i for i, owner in enumerate(owners) if owner in limits]
    free = with_sizes(evaluator, evaluator.free, first.x, row, rows)
    slopes = np.abs(first.jacobian) * np.asarray(free.slopes(first.x))
    made = [_sized(dataclasses.replace(limits[owners[i]], name=names[i]), first.values[i], slopes[i]) for i in rows]
    task = Task(evaluator, free, row, np.array(rows, int), made)
    if not first.is_good:
        return task
    task = task.measured(first)
    if not task.size:
        raise ModelError(
            f"{objective} does not depend on {', '.join(evaluator.free.names)} at the start: its derivatives are zero. "
            "Functions that count or round cannot be minimised by gradients: compare designs by `sweep`."
        )
    return task


def _sized(limit: Limit, result: float, slopes: np.ndarray) -> Limit:
    """A limit of zero gets the size of the result at the start, or of its change between the bounds."""
    if limit.value:
        return limit
    known = [size for size in (abs(float(result)), float(np.max(slopes))) if np.isfinite(size)]
    return dataclasses.replace(limit, measure=max(known, default=0.0) or 1.0)


def with_sizes(evaluator: Evaluator, free: Free, x: np.ndarray, objective: int, rows: Iterable[int]) -> Free:
    """The free parameters with larger sizes of those over which all results are linear.

    A size grows until the slope of a result changes over it. It stays unchanged if no size changes a slope.
    """
    here = evaluator(x)
    if not here.is_good:
        return free
    sizes: dict[int, float] = {}
    for group in free.open_groups:
        size = max(free.variables[i].size for i in group)

        def is_bent(decade: int, group: list[int] = group, size: float = size) -> bool | None:
            there = evaluator(_moved(free, here, group, size * 10.0**decade, objective))
            return _is_bent(here, there, group, [objective, *rows]) if there.is_good else None

        sizes |= dict.fromkeys(group, size * 10.0 ** _decade(is_bent))
    return free.with_sizes(sizes)


def _decade(is_bent: Callable[[int], bool | None]) -> int:
    """The smallest decade over which slopes change, or zero. `is_bent` returns None if nothing can be computed."""
    for decade in DECADES:
        found = is_bent(decade)
        if found is not False:
            between = (k for k in range(max(decade - 2, 0), decade) if is_bent(k))
            return next(between, decade if found else max(decade - DECADES.step, 0))
    return 0


def _moved(free: Free, here: Evaluation, group: list[int], size: float, objective: int) -> np.ndarray:
    """The point one size away, in the direction of descent if that is within the bounds."""
    x = here.x.copy()
    falls = np.where(here.jacobian[objective, group] > 0.0, -size, size)
    is_inside = (x[group] + falls >= free.low[group]) & (x[group] + falls <= free.high[group])
    x[group] += np.where(is_inside, falls, -falls)
    return x


def _is_bent(here: Evaluation, there: Evaluation, group: list[int], rows: list[int]) -> bool:
    slopes = [np.abs(found.jacobian[np.ix_(rows, group)]) for found in (here, there)]
    change = np.abs(there.jacobian - here.jacobian)[np.ix_(rows, group)]
    return bool(np.any(change > STRAIGHT * np.maximum(*slopes)))
