"""Sizes of variables that lack a bound, checked by what the results of a model say."""

from collections.abc import Callable, Iterable

import numpy as np

from .._compute.evaluator import Evaluation, Evaluator
from .._problem.free import Free

STRAIGHT = 0.1  # relative change of a slope below which a result is a straight line
DECADES = range(0, 16, 3)  # by which sizes are tried; those between are tried once a slope changes


def with_sizes(evaluator: Evaluator, free: Free, x: np.ndarray, objective: int, rows: Iterable[int]) -> Free:
    """The free parameters with larger sizes where the given ones are too small to see more than straight lines.

    A size grows until a slope of the objective or of another result changes over it. It stays as it is if no slope
    changes over any size.
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
    """The least decade over which slopes change; zero if there is none. None stands for what cannot be computed."""
    for decade in DECADES:
        found = is_bent(decade)
        if found is not False:
            between = (k for k in range(max(decade - 2, 0), decade) if is_bent(k))
            return next(between, decade if found else max(decade - DECADES.step, 0))
    return 0


def _moved(free: Free, here: Evaluation, group: list[int], size: float, objective: int) -> np.ndarray:
    """The place at a distance of one size, where the objective falls if that side is within the bounds."""
    x = here.x.copy()
    falls = np.where(here.jacobian[objective, group] > 0.0, -size, size)
    is_inside = (x[group] + falls >= free.low[group]) & (x[group] + falls <= free.high[group])
    x[group] += np.where(is_inside, falls, -falls)
    return x


def _is_bent(here: Evaluation, there: Evaluation, group: list[int], rows: list[int]) -> bool:
    slopes = [np.abs(found.jacobian[np.ix_(rows, group)]) for found in (here, there)]
    change = np.abs(there.jacobian - here.jacobian)[np.ix_(rows, group)]
    return bool(np.any(change > STRAIGHT * np.maximum(*slopes)))
