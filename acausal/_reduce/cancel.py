"""Cancellation of fixed coefficients, such as voltages around a loop: equations are rewritten so that the structure
shows it.
"""

import dataclasses
import math
from collections import Counter
from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from .._errors import StructureError, listed
from .aliases import Family, Merged
from .flat_model import FlatModel
from .graph import inverted, match, strong_components
from .incidence import Incidence, tabulate
from .index import FRACTIONS, MODULAR, PRIME, Reduced, Row, dependencies, fixed_rows, modular, reduce_index
from .template import sum_template

ROUNDS = 50


def reduced_exactly(flat: FlatModel, merged: Merged) -> tuple[Merged, Reduced]:
    """Index reduction of equations that can be dependent although their structure does not show it.

    Pantelides' algorithm sees the variables of an equation, but not that v1 = a - b and v2 = a - b are the same
    condition on a and b. If the coefficients of the highest derivatives are singular for almost all parameters,
    equations with fixed coefficients are replaced by linear combinations without the cancelled variables, here v1 = v2,
    until they are regular (combinatorial relaxation; Murota, `Matrices and Matroids for Systems Analysis`, 2000).

    Raises `StructureError` if no such combination exists.
    """
    for _ in range(ROUNDS):
        reduced = reduce_index(tabulate(flat, merged))
        changes = {row: parts for block in _singular_blocks(reduced) for row, parts in _combined(reduced, block)}
        if not changes:
            return merged, reduced
        merged = dataclasses.replace(merged, families=_rewritten(reduced.incidence, changes))
    raise StructureError(f"Equations with fixed coefficients still cancel after {ROUNDS} rounds of rewriting.")


def is_singular(reduced: Reduced) -> bool:
    """Whether coefficients of highest derivatives are singular for almost all parameters."""
    return next(_singular_blocks(reduced), None) is not None


@dataclasses.dataclass
class _Block:
    """Equations with the highest derivatives that they determine together, and the coefficients of these."""

    rows: list[int]
    columns: list[dict[int, int]]  # for each row, the table entry of each variable


def _singular_blocks(reduced: Reduced) -> Iterator[_Block]:
    """The dependent equations of each singular block."""
    known: set[tuple] = set()
    for block in _blocks(reduced):
        key = _key(reduced.incidence, block)
        if key in known:
            continue
        if dependent := _dependent(reduced.incidence, block):
            yield _Block([block.rows[i] for i in dependent], [block.columns[i] for i in dependent])
        else:
            known.add(key)


def _blocks(reduced: Reduced) -> Iterator[_Block]:
    """The strongly connected blocks of highest derivatives in which two equations have fixed coefficients."""
    table = reduced.incidence
    top = table.order + reduced.differentiations[table.row] == reduced.orders[table.variable]
    own = top & table.matchable
    mate = match(table.row[own], table.variable[own], table.n_rows, table.n_variables)
    user, provider = table.row[top], inverted(mate, table.n_variables)[table.variable[top]]
    count, label = strong_components(user, provider, table.n_rows)
    candidate = np.bincount(label[fixed_rows(table)], minlength=count) >= 2
    inside = np.flatnonzero(top)[(label[user] == label[provider]) & candidate[label[user]]]
    blocks: dict[int, dict[int, dict[int, int]]] = {}
    for entry, row, variable in zip(
        inside.tolist(), table.row[inside].tolist(), table.variable[inside].tolist(), strict=True
    ):
        blocks.setdefault(int(label[row]), {}).setdefault(row, {})[variable] = entry
    for rows in blocks.values():
        yield _Block(list(rows), list(rows.values()))


def _key(table: Incidence, block: _Block) -> tuple:
    """A key that is equal for blocks with equal coefficients."""
    place: dict[int, int] = {}
    return tuple(
        tuple(
            (place.setdefault(variable, len(place)), float(table.number[e]) if table.strength[e] == 3 else None)
            for variable, e in columns.items()
        )
        for columns in block.columns
    )


def _dependent(table: Incidence, block: _Block) -> list[int]:
    """The equations of a block, by position, that are linearly dependent for almost all parameters."""
    draw = np.random.default_rng(0).integers(1, PRIME, sum(map(len, block.columns))).tolist()
    numbers = iter(draw)
    rows: list[Row] = [
        {
            variable: modular(table.number[e]) if table.strength[e] == 3 else number
            for (variable, e), number in zip(columns.items(), numbers, strict=False)
        }
        for columns in block.columns
    ]
    return sorted({i for combination in dependencies(rows, MODULAR) for i in combination})


def _combined(reduced: Reduced, block: _Block) -> Iterator[tuple[int, dict[int, Fraction]]]:
    """Equations to replace, each with its combination, as factors of equations.

    A combination eliminates all variables except those that the other equations contain.
    """
    table = reduced.incidence
    fixed = set(fixed_rows(table).tolist())
    touched = {v for row, columns in zip(block.rows, block.columns, strict=True) if row not in fixed for v in columns}
    rows = [row for row in block.rows if row in fixed]
    others = [
        {v: Fraction(float(table.number[e])) for v, e in columns.items() if v not in touched}
        for row, columns in zip(block.rows, block.columns, strict=True)
        if row in fixed
    ]
    found = [{rows[i]: x for i, x in parts.items()} for parts in dependencies(others, FRACTIONS) if len(parts) > 1]
    if not found:
        names = listed([table.row_name(row) for row in block.rows])
        raise StructureError(
            f"These equations are linearly dependent for all values of the parameters and leave the rest "
            f"undetermined:\n  {names}\n  Remedy: remove one of these elements, or give it a resistance or compliance."
        )
    uses = Counter(row for parts in found for row in parts)
    for parts in found:
        # The combination replaces an equation of no other one, so the stated equations still follow.
        yield next(row for row in parts if uses[row] == 1), parts


def _rewritten(table: Incidence, changes: dict[int, dict[int, Fraction]]) -> list[Family]:
    """The families of equations after the replacements."""
    kept = np.ones(table.n_rows, bool)
    kept[list(changes)] = False
    families = [
        family.select(np.flatnonzero(kept[start:stop]))
        for family, start, stop in zip(table.families, table.offsets, table.offsets[1:], strict=False)
        if np.any(kept[start:stop])
    ]
    alike: dict[tuple, list[tuple[list[int], str]]] = {}
    for row, parts in changes.items():
        nodes, coefficients = _sum(table, parts)
        shape = table.place(row)[0].template.shape
        name = " combined with ".join(table.row_name(part) for part in parts)
        alike.setdefault((coefficients, shape), []).append((nodes, name))
    for (coefficients, shape), sums in alike.items():
        nodes = np.array([nodes for nodes, _ in sums])
        names = [name for _, name in sums]
        template = sum_template(coefficients, shape)
        families.append(Family(template, None, np.arange(len(sums)), nodes, np.ones_like(nodes), names))
    return families


def _sum(table: Incidence, parts: dict[int, Fraction]) -> tuple[list[int], tuple[float, ...]]:
    """The nodes in a combination of equations and their coefficients, which are small integers."""
    total: dict[int, Fraction] = {}
    use = np.flatnonzero(np.isin(table.row, list(parts)))
    for entry in use.tolist():
        node = int(table.variables[table.variable[entry]])
        share = parts[int(table.row[entry])] * Fraction(float(table.number[entry]))
        total[node] = total.get(node, Fraction(0)) + share
    terms = [(node, value) for node, value in sorted(total.items()) if value]
    whole = math.lcm(*(value.denominator for _, value in terms))
    least = math.gcd(*(int(value * whole) for _, value in terms)) or 1
    factor = Fraction(whole, least) * (1 if not terms or terms[0][1] > 0 else -1)
    terms.sort(key=lambda term: (abs(term[1]), term[1]))
    return [node for node, _ in terms], tuple(float(value * factor) for _, value in terms)
