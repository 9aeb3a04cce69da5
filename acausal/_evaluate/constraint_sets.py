"""The constraints of a system, by connected sets."""

import math

import numpy as np

from .._reduce.chain import Steps, chain
from .._reduce.graph import sharing
from .._reduce.sort import Sorted
from .._reduce.states import nominal_of
from .constraints import Constraints
from .plan import Plan
from .program import chained_program_of


def constraints_of(ordered: Sorted, plan: Plan, kinds: dict[int, int], *, only_invariant: bool) -> Constraints:
    """All constraints, or the connected sets with an invariant, onto which a run is projected.

    In the latter, dependent variables follow from the states where equations determine them one by one. They are no
    variables then, so the matrices are small.
    """
    chosen = [rows for rows in _connected(ordered) if _wanted(ordered, rows, only_invariant)]
    chains = [chain(ordered, rows, ordered.states) if only_invariant else [] for rows in chosen]
    rest = [_without(rows, steps) for rows, steps in zip(chosen, chains, strict=True)]
    sets = [chained_program_of(ordered, steps, rows, kinds) for steps, rows in zip(chains, rest, strict=True)]
    used = {pair for use in sets for pair in use.values}
    pairs = [pair for pair in ordered.constrained if pair in used] if only_invariant else ordered.constrained
    own = Plan([], pairs, plan.shapes)
    counts = [plan.size(v) for v, _ in pairs]
    sizes = np.repeat([nominal_of(ordered.table, pair) for pair in pairs], counts)
    first = dict(zip(pairs, np.cumsum([0, *counts]).tolist(), strict=False))
    places, ours = [np.zeros(0, int)], [np.zeros(0, int)]
    for pair, start in zip(ordered.states, plan.starts.tolist(), strict=False):
        if pair in first:
            elements = np.arange(plan.size(pair[0]))
            places.append(first[pair] + elements)
            ours.append(start + elements)
    groups = own.residual_groups(sets)
    rows_of = {id(use): rows for use, rows in zip(sets, rest, strict=True)}
    names = [name for group in groups for use in group.uses for name in _names(ordered, rows_of[id(use)])]
    return Constraints(list(pairs), own, groups, names, sizes, np.concatenate(places), np.concatenate(ours))


def _without(rows: list[int], steps: Steps) -> list[int]:
    done = {row for row, _ in steps}
    return [row for row in rows if row not in done]


def _names(ordered: Sorted, rows: list[int]) -> list[str]:
    """The name of the equation of each element of the residuals."""
    table = ordered.table
    sizes = [math.prod(table.place(row)[0].template.shape) for row in rows]
    return [table.row_name(row) for row, size in zip(rows, sizes, strict=True) for _ in range(size)]


def _wanted(ordered: Sorted, rows: list[int], only_invariant: bool) -> bool:
    return not only_invariant or not ordered.invariants.isdisjoint(rows)


def _connected(ordered: Sorted) -> list[list[int]]:
    """Sets of constraints that share variables."""
    table = ordered.table
    chosen = np.isin(table.row, ordered.constraints)
    pair = table.variable[chosen] * 16 + table.order[chosen]
    return sharing(ordered.constraints, table.row[chosen], pair)[0]
