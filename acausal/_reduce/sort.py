"""Sorting into block-triangular form: blocks of equations and unknowns, each solvable after those before it."""

import dataclasses
import functools as ft
import itertools
from collections.abc import Iterable, Sequence

import numpy as np

from .._errors import StructureError
from .aliases import Family
from .graph import inverted, match, strong_components
from .incidence import Incidence, Pair, tabulate
from .states import Chosen


@dataclasses.dataclass
class Block:
    """Equations (rows of the table) and the unknowns that they determine; `level` counts the blocks before it."""

    rows: list[int]
    unknowns: list[int]
    level: int


@dataclasses.dataclass
class Sorted:
    """The equations of the reduced system, differentiated ones included, in block-triangular form.

    `states` and `unknowns` are (variable, derivative order) pairs; `column` is the unknown of each table entry, -1
    if the entry is a state.
    """

    table: Incidence
    states: list[Pair]
    unknowns: list[Pair]
    column: np.ndarray
    blocks: list[Block]
    constraints: list[int]  # differentiated equations: they restrict the start values of states
    invariants: frozenset[int]  # those that determine no unknown and restrict only states
    constrained: list[Pair]  # pairs below the highest derivatives, to which they apply

    @ft.cached_property
    def entries_of_row(self) -> list[np.ndarray]:
        order = np.argsort(self.table.row, kind="stable")
        bounds = np.searchsorted(self.table.row[order], np.arange(self.table.n_rows + 1))
        return [order[a:b] for a, b in itertools.pairwise(bounds)]

    def unknown_name(self, unknown: int) -> str:
        return self.table.variable_name(*self.unknowns[unknown])


def sort(chosen: Chosen) -> Sorted:
    """Order the equations, differentiated ones included, into the strongly connected blocks of their digraph.

    Raises `StructureError` if the chosen states leave other unknowns undetermined.
    """
    table, constraints, invariants = _expanded(chosen)
    renumbered = np.searchsorted(table.variables, chosen.reduced.incidence.variables).tolist()
    states = [(renumbered[v], k) for v, k in chosen.states()]
    code = {pair: index for index, pair in enumerate(sorted((renumbered[v], k) for v, k in _unknowns(chosen)))}
    unknowns = list(code)
    width = 16
    lookup = np.full(table.n_variables * width, -1)
    for (variable, order), index in code.items():
        lookup[variable * width + order] = index
    column = lookup[table.variable * width + table.order]
    blocks = _blocks(table, column, len(unknowns), invariants)
    orders = chosen.reduced.orders.tolist()
    below = [(renumbered[v], k) for v, top in enumerate(orders) for k in range(top)]
    return Sorted(table, states, unknowns, column, blocks, constraints, frozenset(invariants), below)


def _unknowns(chosen: Chosen) -> list[Pair]:
    orders = chosen.reduced.orders.tolist()
    last = (chosen.reduced.orders - chosen.dummies).tolist()
    return [(v, k) for v, (first, top) in enumerate(zip(last, orders, strict=True)) for k in range(first, top + 1)]


def _expanded(chosen: Chosen) -> tuple[Incidence, list[int], list[int]]:
    """The table of all equations, in their stated form and after each differentiation.

    Also the rows that were differentiated further, and the invariants among them.
    """
    reduced = chosen.reduced
    families: list[Family] = []
    is_lower: list[np.ndarray] = []
    is_moving: list[np.ndarray] = []
    for index, family in enumerate(reduced.incidence.families):
        start, stop = reduced.incidence.offsets[index : index + 2]
        counts = reduced.differentiations[start:stop]
        for level in range(int(counts.max(initial=0)) + 1):
            rows = np.flatnonzero(counts >= level)
            families.append(_differentiated(family.select(rows), level))
            is_lower.append(counts[rows] > level)
            is_moving.append(chosen.moving[start:stop][rows])
    table = tabulate(reduced.incidence.flat, dataclasses.replace(reduced.incidence.merged, families=families))
    if not families:
        return table, [], []
    lower = np.concatenate(is_lower)
    moving = lower & np.concatenate(is_moving)
    return table, np.flatnonzero(lower).tolist(), np.flatnonzero(moving).tolist()


def _differentiated(family: Family, times: int) -> Family:
    """The family with its template differentiated; an input keeps the node of its slot."""
    if times == 0:
        return family
    template = family.template.differentiated(times)
    position: dict[Pair, int] = {}
    for i, item in enumerate(family.template.inputs):
        position.setdefault((item.slot, item.element), i)
    columns = [position[item.slot, item.element] for item in template.inputs]
    nodes, signs = family.nodes[:, columns], family.signs[:, columns]
    return dataclasses.replace(family, template=template, nodes=nodes, signs=signs)


def _blocks(table: Incidence, column: np.ndarray, n_unknowns: int, invariants: list[int]) -> list[Block]:
    solves = np.ones(table.n_rows, bool)
    solves[invariants] = False
    unknown = (column >= 0) & solves[table.row]
    own = unknown & table.matchable
    mate = match(table.row[own], column[own], table.n_rows, n_unknowns)
    if np.any(mate[solves] < 0) or np.count_nonzero(solves) != n_unknowns:
        names = ", ".join(table.row_name(int(row)) for row in np.flatnonzero((mate < 0) & solves)[:5])
        raise StructureError(f"With the chosen states, no unknown is left for the equations {names}.")
    user, provider = table.row[unknown], inverted(mate, n_unknowns)[column[unknown]]
    count, label = strong_components(user, provider, table.n_rows)
    level = _levels(label[user], label[provider], count)
    rows: list[list[int]] = [[] for _ in range(count)]
    for row in np.flatnonzero(solves).tolist():
        rows[label[row]].append(row)
    filled = [block for block in range(count) if rows[block]]
    order = sorted(filled, key=lambda block: (level[block], rows[block][0]))
    return [Block(rows[b], [int(mate[row]) for row in rows[b]], int(level[b])) for b in order]


def _levels(user: np.ndarray, provider: np.ndarray, count: int) -> np.ndarray:
    """The number of blocks before each one on the longest path."""
    outside = user != provider
    pairs = np.unique(np.stack([provider[outside], user[outside]], axis=1), axis=0)
    waiting = np.bincount(pairs[:, 1], minlength=count)
    bounds = np.searchsorted(pairs[:, 0], np.arange(count + 1)).tolist()
    users, waiting = pairs[:, 1].tolist(), waiting.tolist()
    level = [0] * count
    ready = [block for block in range(count) if waiting[block] == 0]
    for block in ready:
        for other in users[bounds[block] : bounds[block + 1]]:
            level[other] = max(level[other], level[block] + 1)
            waiting[other] -= 1
            if waiting[other] == 0:
                ready.append(other)
    return np.array(level, int)


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
