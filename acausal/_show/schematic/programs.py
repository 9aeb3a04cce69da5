"""Places on a line from linear programs: least total length between bounds."""

from collections.abc import Sequence

import numpy as np
import scipy

Link = tuple[int, int, float, float]  # from, to, distance wanted, weight
Bound = tuple[int, int, float]  # from, to, least distance


def least_lengths(count: int, links: Sequence[Link], bounds: Sequence[Bound]) -> np.ndarray:
    """Integers x with least sum of weight |x_b - x_a - wanted| over links, and x_b - x_a >= least for bounds.

    The matrix of differences is totally unimodular, so with integer distances the vertices are integer.
    """
    if not count:
        return np.zeros(0, int)
    size = count + len(links)
    rows = [_difference(size, a, b, -1.0) for a, b, _ in bounds]
    limits = [-least for _, _, least in bounds]
    for i, (a, b, wanted, _) in enumerate(links):
        for sign in (1.0, -1.0):
            row = _difference(size, a, b, sign)
            row[count + i] = -1.0
            rows.append(row)
            limits.append(sign * wanted)
    # A slight pull towards zero makes the optimum unique.
    cost = np.concatenate([np.full(count, 1e-6), [weight for *_, weight in links]])
    found = scipy.optimize.linprog(
        cost, np.array(rows).reshape(-1, size), limits, bounds=(0.0, None), method="highs-ds"
    )
    return np.round(found.x[:count]).astype(int)


def _difference(size: int, a: int, b: int, sign: float) -> np.ndarray:
    row = np.zeros(size)
    row[b] += sign
    row[a] -= sign
    return row
