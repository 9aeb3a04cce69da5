"""Constraints that determine variables, below their highest derivatives, one at a time."""

from collections.abc import Iterable, Sequence

from .incidence import Pair
from .sort import Sorted

Steps = list[tuple[int, Pair]]  # equations, each with the pair that it determines


def chain(ordered: Sorted, rows: Sequence[int], *known: Iterable[Pair]) -> Steps:
    """Constraints, each with the pair that it determines, in solvable order.

    Each collection of `known` pairs has priority over the next one: a pair of the next that already follows from the
    first is determined, not known.
    """
    solvable = {row: entries_of(ordered, row) for row in rows}
    unknown = {row: set(pairs) for row, pairs in solvable.items()}
    users: dict[Pair, list[int]] = {}
    for row, pairs in solvable.items():
        for pair in pairs:
            users.setdefault(pair, []).append(row)
    steps: dict[Pair, int] = {}
    found: set[Pair] = set()

    def solved(row: int) -> list[Pair]:
        new = [pair for pair in unknown[row] - found if len(unknown[row]) == 1 and solvable[row][pair]]
        found.update(new)
        steps.update(dict.fromkeys(new, row))
        return new

    def spread(queue: list[Pair]) -> None:
        for pair in queue:
            for row in users.get(pair, ()):
                unknown[row].discard(pair)
                queue += solved(row)

    for pairs in known:
        own = [pair for pair in pairs if pair not in found]
        found.update(own)  # all of them keep their values
        spread([*own, *(pair for row in rows for pair in solved(row))])
    return [(row, pair) for pair, row in steps.items()]


def entries_of(ordered: Sorted, row: int) -> dict[Pair, bool]:
    """The pairs in an equation, and whether it can be solved for each."""
    table = ordered.table
    return {
        (int(table.variable[e]), int(table.order[e])): bool(table.strength[e] >= 2 and table.matchable[e])
        for e in ordered.entries_of_row[row].tolist()
    }
