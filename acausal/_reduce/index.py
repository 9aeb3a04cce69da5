"""Structural solvability, linear dependence, and index reduction: the number of differentiations of each equation."""

import dataclasses
import heapq
from collections.abc import Callable, Iterable
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from .._errors import StructureError, complain, listed
from .flat_model import reference_of
from .graph import inverted, match, neighbours, reach
from .incidence import Incidence

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


@dataclasses.dataclass
class Reduced:
    """`differentiations` of each equation and highest derivative (`orders`) of each variable after index reduction."""

    incidence: Incidence
    differentiations: np.ndarray
    orders: np.ndarray


def reduce_index(table: Incidence) -> Reduced:
    """Pantelides' algorithm (SIAM J. Sci. Stat. Comput. 9, 1988), on offsets instead of copied equations.

    An equation differentiated c times has its entry of order k at order k + c. A set of equations with too few highest
    derivatives is differentiated as a whole until every equation has a highest derivative of its own.

    Raises `StructureError`, naming equations and variables, if the system is structurally singular.
    """
    _check_solvable(table)
    _check_redundant(table)
    return with_least_orders(table, np.zeros(table.n_variables, int))


def with_least_orders(table: Incidence, least: np.ndarray) -> Reduced:
    """The index reduction of a solvable system in which the highest derivatives have at least these orders."""
    rows, variables, order = _highest(table)
    orders = least.astype(int)
    np.maximum.at(orders, table.variable, table.order)
    counts = np.zeros(table.n_rows, int)
    top = order == orders[variables]
    mate = match(rows[top], variables[top], table.n_rows, table.n_variables)
    if np.any(mate < 0):
        _differentiate(rows, variables, order, counts, orders, mate)
        _check_shapes(table, counts, orders)
    return Reduced(table, counts, orders)


def _check_shapes(table: Incidence, counts: np.ndarray, orders: np.ndarray) -> None:
    """Check that the differentiated equations contain no derivative of an array above its highest one.

    An equation for some elements of an array does not determine the array, so the search passes over it.
    """
    above = ~table.matchable & (table.order + counts[table.row] > orders[table.variable])
    if np.any(above):
        names = listed(sorted({table.variable_name(v) for v in table.variable[above].tolist()}))
        raise StructureError(f"Equations for elements determine the derivatives of these arrays only in parts: {names}")


def _highest(table: Incidence) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Matchable (row, variable) pairs with the highest order of the variable in the row."""
    use = table.matchable
    key = table.row[use] * table.n_variables + table.variable[use]
    unique, inverse = np.unique(key, return_inverse=True)
    order = np.zeros(len(unique), int)
    np.maximum.at(order, inverse, table.order[use])
    return unique // max(table.n_variables, 1), unique % max(table.n_variables, 1), order


def _differentiate(
    rows: np.ndarray, variables: np.ndarray, order: np.ndarray, counts: np.ndarray, orders: np.ndarray, mate: np.ndarray
) -> None:
    """Raise `counts` and `orders` until each equation is matched with a highest derivative."""
    edges: list[list[tuple[int, int]]] = [[] for _ in range(len(counts))]
    for row, variable, k in zip(rows.tolist(), variables.tolist(), order.tolist(), strict=True):
        edges[row].append((variable, k))
    partner = inverted(mate, len(orders))
    for row in np.flatnonzero(mate < 0).tolist():
        while True:
            found, visited_rows, visited_variables = _augment(row, edges, counts, orders, partner)
            if found:
                break
            counts[list(visited_rows)] += 1
            orders[list(visited_variables)] += 1


def _augment(
    row: int, edges: list[list[tuple[int, int]]], counts: np.ndarray, orders: np.ndarray, partner: np.ndarray
) -> tuple[bool, set[int], set[int]]:
    """Search breadth-first for an alternating path to a free highest derivative, and flip it."""
    came_from: dict[int, int] = {}
    visited_rows, queue = {row}, [row]
    for current in queue:
        for variable, k in edges[current]:
            if k + counts[current] != orders[variable] or variable in came_from:
                continue
            came_from[variable] = current
            mate = int(partner[variable])
            if mate < 0:
                _flip(variable, came_from, partner, row)
                return True, visited_rows, set(came_from)
            if mate not in visited_rows:
                visited_rows.add(mate)
                queue.append(mate)
    return False, visited_rows, set(came_from)


def _flip(variable: int, came_from: dict[int, int], partner: np.ndarray, start: int) -> None:
    while True:
        row = came_from[variable]
        previous = np.flatnonzero(partner == row)
        partner[variable] = row
        if row == start:
            return
        variable = int(previous[0])


def _check_solvable(table: Incidence) -> None:
    """Check that every equation has a variable of its own, and every variable an equation."""
    use = table.matchable
    rows, variables = table.row[use], table.variable[use]
    mate = match(rows, variables, table.n_rows, table.n_variables)
    if np.all(mate >= 0) and table.n_rows == table.n_variables:
        return
    partner = inverted(mate, table.n_variables)
    spare_rows = np.flatnonzero(mate < 0).tolist()
    spare_variables = np.flatnonzero(partner < 0).tolist()
    raise StructureError(_explanation(table, rows, variables, mate, partner, spare_rows, spare_variables))


def _explanation(
    table: Incidence, rows: np.ndarray, variables: np.ndarray, mate: np.ndarray, partner: np.ndarray,
    spare_rows: list[int], spare_variables: list[int],
) -> str:  # fmt: skip
    """The over- and under-determined parts of Dulmage and Mendelsohn, each split into independent pieces."""
    counts = f"{_count(table.n_rows, 'equation')} for {_count(table.n_variables, 'variable')}"
    lines = [f"The model has {counts} and cannot be solved."]
    for over, touched in _pieces(spare_rows, neighbours(rows, variables, table.n_rows), partner):
        equations = listed([table.row_name(row) for row in sorted(over)])
        if touched:
            lines.append(f"Too many equations: {len(over)} of them determine only {_count(len(touched), 'variable')}.")
            lines.append(f"  equations: {equations}")
            lines.append("  variables: " + listed([table.placed_name(v) for v in sorted(touched)]))
        else:
            lines.append(f"Too many equations: {equations} has no variable to determine.")
            lines.append("  Its quantities are parameters, or variables that are zero or known without it.")
        open_ports = _open_ports(table, over)
        lines += [f"  Nothing is connected to {port}, so {flow} is zero there." for port, flow in open_ports]
        lines.append(
            f"  Remedy: {'connect it, or ' if open_ports else ''}remove one of these equations or components (two "
            "ideal sources in parallel, a value fixed twice), or put an element between them."
        )
    for under, touched in _pieces(spare_variables, neighbours(variables, rows, table.n_variables), mate):
        lines.append(
            f"Too few equations: only {_count(len(touched), 'equation')} for {_count(len(under), 'variable')}."
        )
        lines.append("  variables: " + listed([table.placed_name(v) for v in sorted(under)]))
        lines.append("  equations: " + listed([table.row_name(row) for row in sorted(touched)]))
        lines.append(
            "  Remedy: add an equation or a component that determines one of these variables" + _hint(table, under)
        )
    return "\n".join(lines)


def _open_ports(table: Incidence, rows: Iterable[int]) -> list[tuple[str, str]]:
    """The ports of the components in these equations to which nothing is connected, and the name of their flow."""
    flat, found = table.flat, dict[tuple[str, str], None]()
    for family, inside in map(table.place, sorted(rows)):
        if family.instances is not None:
            nodes = flat.nodes(family.instances)[family.members[inside]].tolist()
            names = [flat.node_name(node).rpartition(".") for node in nodes if node in flat.unconnected]
            found |= {(port, flow): None for port, _, flow in names}
    return list(found)


def _pieces(start: list[int], edges: list[list[int]], partner: np.ndarray) -> list[tuple[set[int], set[int]]]:
    """The sets that alternating paths reach from each unmatched item, overlapping sets merged."""
    pieces: list[tuple[set[int], set[int]]] = []
    for item in start:
        here, there = reach([item], edges, partner)
        meeting = [piece for piece in pieces if not there.isdisjoint(piece[1])]
        pieces = [piece for piece in pieces if there.isdisjoint(piece[1])]
        pieces.append((here.union(*(p[0] for p in meeting)), there.union(*(p[1] for p in meeting))))
    return pieces


def _hint(table: Incidence, under: set[int]) -> str:
    """The open inputs of the model, or the missing reference, if all undetermined variables are those of ports."""
    flat = table.flat
    leaves = [flat.leaves[flat.leaf_of_node[table.variables[v]]] for v in under]
    inputs = dict.fromkeys(
        leaf.path.rpartition(".")[0] for leaf in leaves if leaf.port is not None and leaf.port.needs_connection
    )
    if inputs:
        return f": nothing is connected to {listed(sorted(inputs))}. Make the model a part, and connect it."
    if all(leaf.in_port and leaf.declaration.role == "var" for leaf in leaves):
        return f": nothing fixes their level, so connect {reference_of(leaves)}."
    return "."


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("" if number == 1 else "s")


def fixed_rows(table: Incidence, *, with_rest: bool = False) -> np.ndarray:
    """Equations that are sums of variables with constant factors and, `with_rest`, of any known terms."""
    fixed = np.ones(table.n_rows, bool)
    fixed[table.row[(table.strength < 3) | (table.order > 0)]] = False
    for index, family in enumerate(table.families):
        if family.template.level or (family.template.form.has_rest and not with_rest):
            fixed[table.offsets[index] : table.offsets[index + 1]] = False
    return np.flatnonzero(fixed)


def _check_redundant(table: Incidence) -> None:
    """Check that equations with constant coefficients, mainly sums of flows, are linearly independent.

    Structure does not show that the flows around a circuit without ground sum to zero; elimination with exact fractions
    does.
    """
    fixed = fixed_rows(table, with_rest=True).tolist()
    terms: dict[int, Row] = {row: {} for row in fixed}
    use = np.isin(table.row, fixed)
    for row, variable, number in zip(
        table.row[use].tolist(), table.variable[use].tolist(), table.number[use].tolist(), strict=True
    ):
        terms[row][variable] = Fraction(number)
    for combination in dependencies(list(terms.values()), FRACTIONS):
        rows = sorted(fixed[i] for i in combination)
        complain(
            StructureError(
                "These equations repeat or contradict each other, and leave the rest undetermined:\n  "
                + listed([table.row_name(row) for row in rows])
                + f"\n  Remedy: {_remedy(table, rows)}"
            )
        )


def _remedy(table: Incidence, rows: list[int]) -> str:
    sums = [(family, inside) for family, inside in map(table.place, rows) if family.instances is None]
    if sums:
        lacking = reference_of(leaf for family, inside in sums for leaf in family.leaves(inside, table.flat))
        return f"a circuit without a reference has one sum of flows too many; connect {lacking} to it."
    return "remove one of these equations or components (two ideal sources in parallel, a value fixed twice)."
