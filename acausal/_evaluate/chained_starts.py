"""Start values of dependent variables that follow from others one equation at a time."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Array, Float

from .._numbers import Numbers
from .._reduce.incidence import Pair
from .._reduce.sort import Sorted
from .plan import Plan
from .program import step_program_of
from .starts import Inputs
from .system import System


def chained(system: System, x: Float[Array, " elements"], given: np.ndarray, t: Numbers, inputs: Inputs) -> Array:
    """The start values x of the constrained pairs, with those of dependent variables computed from others where an
    equation determines one of them.

    Values that are `given` determine others first, then so do the remaining states. The iteration that meets all
    constraints then starts near its solution, and not where derivatives do not exist, such as at a vector of zeros that
    is normalised.
    """
    pairs, ordered, size = system.constraints.pairs, system.ordered, system.plan.size
    ends = np.cumsum([size(variable) for variable, _ in pairs])
    held = [pair for pair, end in zip(pairs, ends.tolist(), strict=True) if given[end - 1]]
    steps = _steps(ordered, held)
    levels = _levels(ordered, steps)
    uses = [(levels[pair], step_program_of(ordered, row, pair, system.kind_index)) for row, pair in steps]
    plan = Plan(uses, pairs, system.plan.shapes)
    return plan.collect(plan.evaluate(x, t, inputs.params, system.starts.guess(inputs), pairs), pairs)


def _steps(ordered: Sorted, given: Sequence[Pair]) -> list[tuple[int, Pair]]:
    """Constraints, each with the pair that it determines, in solvable order."""
    solvable = {row: _entries(ordered, row) for row in ordered.constraints}
    unknown = {row: set(pairs) for row, pairs in solvable.items()}
    users: dict[Pair, list[int]] = {}
    for row, pairs in solvable.items():
        for pair in pairs:
            users.setdefault(pair, []).append(row)
    steps: dict[Pair, int] = {}
    known: set[Pair] = set()

    def solved(row: int) -> list[Pair]:
        found = [pair for pair in unknown[row] - known if len(unknown[row]) == 1 and solvable[row][pair]]
        known.update(found)
        steps.update(dict.fromkeys(found, row))
        return found

    def spread(queue: list[Pair]) -> None:
        for pair in queue:
            for row in users.get(pair, ()):
                unknown[row].discard(pair)
                queue += solved(row)

    known.update(given)
    spread([*given, *(pair for row in solvable for pair in solved(row))])
    states = [pair for pair in ordered.states if pair not in known]
    known.update(states)  # all of them keep their values
    spread(states)
    return [(row, pair) for pair, row in steps.items()]


def _entries(ordered: Sorted, row: int) -> dict[Pair, bool]:
    """The pairs in an equation, and whether it can be solved for each."""
    table = ordered.table
    return {
        (int(table.variable[e]), int(table.order[e])): bool(table.strength[e] >= 2 and table.matchable[e])
        for e in ordered.entries_of_row[row].tolist()
    }


def _levels(ordered: Sorted, steps: Sequence[tuple[int, Pair]]) -> dict[Pair, int]:
    """The number of steps before each one on the longest path."""
    levels: dict[Pair, int] = {}
    for row, pair in steps:
        levels[pair] = 1 + max([levels.get(other, 0) for other in _entries(ordered, row) if other != pair], default=0)
    return levels
