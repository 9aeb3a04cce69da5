"""Points of a minimisation in scaled numbers: objective, constraints and their derivatives."""

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np

FEASIBLE = 1e-7  # largest violation of a constraint that counts as none, relative to the size of its limit

Bounds: TypeAlias = tuple[np.ndarray, np.ndarray]


class Point(NamedTuple):
    """A point `z` with objective `f` and constraints `c` <= 0, or `c` = 0 for equations."""

    z: np.ndarray
    f: float
    gradient: np.ndarray
    c: np.ndarray
    jacobian: np.ndarray


PointAt: TypeAlias = Callable[[np.ndarray], Point | None]  # None if nothing can be computed there


def violation(point: Point, is_equation: np.ndarray) -> float:
    """The largest constraint violation."""
    broken = np.where(is_equation, np.abs(point.c), np.maximum(point.c, 0.0))
    return float(np.max(broken, initial=0.0))
