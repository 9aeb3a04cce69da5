"""Exact linear dependence between sparse rows of numbers."""

import heapq
from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple

Row = dict[int, Any]  # the nonzero entries of a row by column

PRIME = 2**61 - 1


class Arithmetic(NamedTuple):
    """Exact arithmetic: the ratio of two numbers, and the canonical form of a number."""

    ratio: Callable[[Any, Any], Any]
    tidy: Callable[[Any], Any]


FRACTIONS = Arithmetic(lambda a, b: a / b, lambda a: a)
# Integers modulo a prime stay short. Random ones in place of unknown coefficients decide correctly for
# almost all values of these (Schwartz, J. ACM 27, 1980).
MODULAR = Arithmetic(lambda a, b: a * pow(b, -1, PRIME) % PRIME, lambda a: a % PRIME)


def modular(number: float) -> int:
    fraction = Fraction(number)
    return fraction.numerator * pow(fraction.denominator, -1, PRIME) % PRIME


def dependencies(rows: list[Row], exact: Arithmetic) -> list[Row]:
    """A basis of the vanishing combinations of rows, each with the factor of each row.

    Every combination has a row that is in no other one: the last row of the elimination.
    """
    core = _core(rows)
    rows = [rows[i] for i in core]
    if not _eliminated([dict(row) for row in rows], exact):
        return []
    # Row i gets a 1 in column width + i, which counts how often it was added to others.
    width = 1 + max((column for row in rows for column in row), default=0)
    tracked = [{**row, width + i: 1} for i, row in enumerate(rows)]
    vanished = _eliminated(tracked, exact, width)
    return [{core[column - width]: factor for column, factor in tracked[i].items()} for i in vanished]


def _core(rows: list[Row]) -> list[int]:
    """The rows that remain when each row with a column that no other row has is removed, again and again. The others
    are in no vanishing combination.
    """
    users = _users(rows)
    alone = [column for column, own in users.items() if len(own) == 1]
    kept = set(range(len(rows)))
    while alone:
        for i in users[alone.pop()] & kept:
            kept.remove(i)
            for column in rows[i]:
                users[column].remove(i)
                if len(users[column]) == 1:
                    alone.append(column)
    return sorted(kept)


def _users(rows: list[Row]) -> dict[int, set[int]]:
    """The rows with an entry in each column."""
    users: dict[int, set[int]] = {}
    for i, row in enumerate(rows):
        for column in row:
            users.setdefault(column, set()).add(i)
    return users


def _eliminated(rows: list[Row], exact: Arithmetic, width: int | None = None) -> list[int]:
    """Gaussian elimination in place, short rows and rare columns first; returns the rows left without a pivot.

    Columns from `width` on are transformed, but provide no pivots.
    """
    users = _users(rows)
    waiting = [(len(row), i) for i, row in enumerate(rows)]
    heapq.heapify(waiting)
    done: set[int] = set()
    left: list[int] = []
    while waiting:
        _, i = heapq.heappop(waiting)
        if i in done:
            continue
        done.add(i)
        candidates = [column for column in rows[i] if width is None or column < width]
        if not candidates:
            left.append(i)
            continue
        pivot = min(candidates, key=lambda column: (len(users[column]), column))
        for other in sorted(users[pivot] - done):
            _subtract(rows, other, i, pivot, users, exact)
            heapq.heappush(waiting, (len(rows[other]), other))
    return left


def _subtract(
    rows: list[Row], target: int, source: int, pivot: int, users: dict[int, set[int]], exact: Arithmetic
) -> None:
    factor = exact.ratio(rows[target][pivot], rows[source][pivot])
    row = rows[target]
    for column, value in rows[source].items():
        new = exact.tidy(row.get(column, 0) - factor * value)
        if new:
            row[column] = new
            users[column].add(target)
        elif column in row:
            del row[column]
            users[column].discard(target)
