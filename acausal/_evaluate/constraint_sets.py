"""The constraints of a system, by connected sets."""

import math
from collections.abc import Sequence

import numpy as np

from .._reduce.graph import sharing
from .._reduce.incidence import Pair
from .._reduce.sort import Sorted, Steps, chain
from .._reduce.states import nominal_of
from .constraints import Constraints
from .plan import Plan
from .program import chained_program_of


def all_constraints(ordered: Sorted, plan: Plan, kinds: dict[int, int]) -> Constraints:
    """All constraints, in all variables below their highest derivatives."""
    return _made(ordered, plan, kinds, [([], rows) for rows in _connected(ordered)], ordered.constrained)


def invariants_of(ordered: Sorted, plan: Plan, kinds: dict[int, int]) -> Constraints:
    """The connected sets of constraints with an invariant, onto which a run is projected, in the states."""
    sets = [rows for rows in _connected(ordered) if not ordered.invariants.isdisjoint(rows)]
    return _chained(ordered, plan, kinds, sets, ordered.states)


def remaining_constraints(ordered: Sorted, plan: Plan, kinds: dict[int, int], given: Sequence[Pair]) -> Constraints:
    """The constraints that remain at a start with `given` pairs, in these pairs and the states."""
    return _chained(ordered, plan, kinds, _connected(ordered), given, ordered.states)


def _chained(
    ordered: Sorted, plan: Plan, kinds: dict[int, int], sets: list[list[int]], *known: Sequence[Pair]
) -> Constraints:
    """Constraints in the known pairs. Dependent variables that follow from them one by one are eliminated, so the
    matrices are small.
    """
    chains = [chain(ordered, rows, *known) for rows in sets]
    rest = [(steps, _without(rows, steps)) for steps, rows in zip(chains, sets, strict=True)]
    return _made(ordered, plan, kinds, [(steps, rows) for steps, rows in rest if rows], None)


def _made(
    ordered: Sorted, plan: Plan, kinds: dict[int, int], sets: list[tuple[Steps, list[int]]], pairs: list[Pair] | None
) -> Constraints:
    """Sets of constraints, each with the steps that determine dependent variables. The variables are those that the
    constraints read, unless all `pairs` are wanted.
    """
    uses = [chained_program_of(ordered, steps, rows, kinds) for steps, rows in sets]
    if pairs is None:
        used = {pair for use in uses for pair in use.values}
        pairs = [pair for pair in ordered.constrained if pair in used]
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
    groups = own.residual_groups(uses)
    rows_of = {id(use): rows for use, (_, rows) in zip(uses, sets, strict=True)}
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


def _connected(ordered: Sorted) -> list[list[int]]:
    """Sets of constraints that share variables."""
    table = ordered.table
    chosen = np.isin(table.row, ordered.constraints)
    pair = table.variable[chosen] * 16 + table.order[chosen]
    return sharing(ordered.constraints, table.row[chosen], pair)[0]
