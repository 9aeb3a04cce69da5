"""Sizes of variables that lack a bound, from the curvature of results."""

from collections.abc import Callable, Iterable

import numpy as np

from .._compute.evaluator import Evaluation, Evaluator
from .._problem.free import Free

STRAIGHT = 0.1  # relative change of a slope below which a result is linear
DECADES = range(0, 16, 3)  # trial factors of sizes; those between are tried once a slope changes


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
