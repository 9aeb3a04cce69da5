"""A problem in scaled numbers: variables from 0 to 1, objective and constraints as fractions of their sizes."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from .._errors import ModelError
from ._free import Free
from ._limits import Limit
from ._program import Evaluation, Program

ROUNDING = 1e-12  # distance of a scaled variable from its bound that is none
BESIDE = 1e-2  # how far inside the bounds a result is looked at again, as a share of their distance


class Point(NamedTuple):
    """A place `z` with objective `f` and constraints `c`, which are at most 0, or 0 where they are equations."""

    z: np.ndarray
    f: float
    gradient: np.ndarray
    c: np.ndarray
    jacobian: np.ndarray


@dataclasses.dataclass
class Task:
    """Minimise one result of a program while others keep their limits.

    `rows` says which result each limit is about. `size` is that of the objective, by which it is divided. `within` are
    bounds of the scaled variables that replace the given ones.
    """

    program: Program
    objective: int
    rows: np.ndarray
    limits: Sequence[Limit]
    size: float = 1.0
    within: tuple[np.ndarray, np.ndarray] | None = None

    @property
    def free(self) -> Free:
        return self.program.free

    @property
    def is_equation(self) -> np.ndarray:
        return np.array([limit.is_equation for limit in self.limits], bool)

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Of the scaled variables; infinite where there are none."""
        free = self.free
        return self.within or (np.asarray(free.scaled(free.low)), np.asarray(free.scaled(free.high)))

    def evaluation(self, z: np.ndarray) -> Evaluation:
        x = np.array(self.free.unscaled(z))
        for bound in (self.free.low, self.free.high):
            x = np.where(np.abs(z - np.asarray(self.free.scaled(bound))) < ROUNDING, bound, x)
        return self.program(x)

    def at(self, z: np.ndarray) -> Point | None:
        """The point at `z`; None where nothing can be computed."""
        found = self.evaluation(z)
        return self.point(z, found) if found.is_good else None

    def point(self, z: np.ndarray, found: Evaluation) -> Point:
        slopes = np.asarray(self.free.slopes(found.x))
        sign = np.array([limit.sign / limit.size for limit in self.limits])
        excess = [limit.excess(found.values[row]) for limit, row in zip(self.limits, self.rows, strict=True)]
        return Point(
            np.array(z, float),
            float(found.values[self.objective] / self.size),
            found.jacobian[self.objective] * slopes / self.size,
            np.array(excess, float),
            sign[:, None] * found.jacobian[self.rows] * slopes,
        )

    @property
    def idle(self) -> np.ndarray:
        """Which variables neither the objective nor a limit depends on, as far as has been evaluated."""
        return self.program.idle([self.objective, *self.rows])

    def violation(self, point: Point) -> float:
        """The largest fraction by which a limit is broken."""
        broken = np.where(self.is_equation, np.abs(point.c), np.maximum(point.c, 0.0))
        return float(np.max(broken, initial=0.0))


def task_of(program: Program, first: Evaluation, objective: str, limits: Mapping[str, Limit]) -> Task:
    """The task of minimising one of the functions of a program, whose first evaluation tells what they return.

    The limit of a function that returns several numbers is one for each of them.
    """
    names, owners = program.names, program.owners
    if (returned := owners.count(objective)) != 1:
        raise ModelError(f"{objective} returned {returned} numbers: what is minimised is one.")
    row = owners.index(objective)
    if first.is_good and not np.any(first.jacobian[row]) and _is_flat(program, first.x, row):
        raise ModelError(
            f"{objective} does not depend on {', '.join(program.free.names)} at the start: its derivatives are zero. "
            "What counts or rounds cannot be minimised by gradients."
        )
    rows = [i for i, owner in enumerate(owners) if owner in limits]
    slopes = np.abs(first.jacobian) * np.asarray(program.free.slopes(first.x))
    made = [_sized(dataclasses.replace(limits[owners[i]], name=names[i]), first.values[i], slopes[i]) for i in rows]
    task = Task(program, row, np.array(rows, int), made)
    task.size = program.size(row) or float(abs(first.values[row])) or 1.0
    return task


def _is_flat(program: Program, x: np.ndarray, row: int) -> bool:
    """Whether a result whose derivatives are zero is constant: then they are zero a little further inside the bounds,
    too, where beside an optimum they are not.
    """
    z = np.asarray(program.free.scaled(x))
    beside = program(np.array(program.free.unscaled(z + np.where(z < 0.5, BESIDE, -BESIDE))))
    return not beside.is_good or not np.any(beside.jacobian[row])


def _sized(limit: Limit, result: float, slopes: np.ndarray) -> Limit:
    """A limit of zero is compared with what the result is at the start, or with what it becomes between the bounds."""
    if limit.value:
        return limit
    known = [size for size in (abs(float(result)), float(np.max(slopes))) if np.isfinite(size)]
    return dataclasses.replace(limit, measure=max(known, default=0.0) or 1.0)
