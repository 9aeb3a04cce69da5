"""Incidence table of the remaining equations: variables with nominal sizes and ranges, orders and coefficients."""

import dataclasses
import functools as ft
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float, Int

from .._declare.annotations import Sign
from .._numbers import Numbers
from .aliases import ZERO, Family, Merged
from .flat_model import FlatLeaf, FlatModel
from .graph import connected

# Defaults for machines of 0.1 m to 2 m, to within a factor of ten. Error tolerances are
# relative to the larger of a variable and this size.
BY_UNIT = {
    "rad": 1.0,
    "rad/s": 10.0,
    "N.m": 1.0,
    "m": 1e-2,
    "m/s": 0.1,
    "N": 100.0,
    "V": 1.0,
    "A": 1.0,
    "C": 1e-3,
    "Wb": 1e-2,
    "Pa": 1e5,
    "m3": 1e-6,
    "m3/s": 1e-5,
    "K": 100.0,
    "W": 10.0,
    "J": 1.0,
}


def nominal_size(leaf: FlatLeaf) -> float:
    """The nominal size given by the model, otherwise the declared one, otherwise that of the unit, otherwise 1."""
    if leaf.nominal is not None:
        return leaf.nominal
    declaration = leaf.declaration
    return BY_UNIT.get(declaration.unit, 1.0) if declaration.nominal is None else declaration.nominal


def nominal_sizes(flat: FlatModel, merged: Merged, variables: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The nominal size of each variable, identified by its representative node, and of its derivative.

    A size that the model gives for an alias has priority over one that a class declares, and that over the size of the
    unit. If several are given, the smallest counts; if several are declared, that of the representative. A given size
    also applies to all variables that equations state to be equal, such as two speeds that are the derivative of one
    angle. Other derivatives have the nominal size per millisecond.
    """
    leaves = [flat.leaves[i] for i in flat.variable_leaves]
    counts = [leaf.count for leaf in leaves]
    size = np.repeat([nominal_size(leaf) for leaf in leaves], counts)
    said = [2 if leaf.nominal is not None else leaf.declaration.nominal is not None for leaf in leaves]
    said = np.repeat(np.array(said, int), counts)
    is_own = merged.representative == np.arange(flat.n_nodes)
    order = np.lexsort((np.where(said == 2, -size, is_own), said))
    known = np.ones(flat.n_nodes)
    order = order[merged.representative[order] >= 0]
    known[merged.representative[order]] = size[order]
    rates, given = 1e3 * known, np.zeros(flat.n_nodes, bool)
    given[merged.representative[order[said[order] == 2]]] = True
    if np.any(given):
        alike = _alike(flat, merged)
        least = np.full(2 * flat.n_nodes, np.inf)
        np.minimum.at(least, alike[: flat.n_nodes][given], known[given])
        own, of_rates = least[alike].reshape(2, -1)
        known = np.where(np.isfinite(own), own, known)
        rates = np.where(np.isfinite(of_rates), of_rates, 1e3 * known)
    return known[variables], rates[variables]


def _alike(flat: FlatModel, merged: Merged) -> np.ndarray:
    """The set number of each node and then of each derivative. A set contains the nodes that single equations and their
    derivatives state to be equal up to the sign, except zero ones.
    """
    n, edges = flat.n_nodes, [np.zeros((0, 2), int)]
    for family in merged.families:
        form, terms = family.template.form, list(family.template.form.terms)
        orders = np.array([family.template.inputs[i].order for i in terms], int)
        numbers = {None if c.number is None else abs(c.number) for c in form.terms.values()}
        if form.nonlinear or form.has_rest or None in numbers or len(numbers) != 1 or np.max(orders) > 1:
            continue
        nodes = family.nodes[:, terms]
        is_left = nodes != ZERO
        nodes, is_left = (
            x[(is_left.sum(axis=1) == 2) & np.all((nodes >= 0) | ~is_left, axis=1)] for x in (nodes, is_left)
        )
        pairs = nodes[is_left].reshape(-1, 2)
        places = np.broadcast_to(orders, nodes.shape)[is_left].reshape(-1, 2)
        edges += [pairs + n * places, pairs[np.all(places == 0, axis=1)] + n]
    return connected(np.concatenate(edges), 2 * n)[1]


Pair = tuple[int, int]  # a variable and the order of its derivative


@dataclasses.dataclass(eq=False)
class Incidence:
    """Equations (rows) of all families and variables in one numbering each, with an entry for each occurrence.

    `number` is the coefficient of the entry if it is one fixed number, otherwise NaN; `strength` is 3 for a number,
    2 for a coefficient that cannot vanish, 1 for any other linear occurrence, 0 for a nonlinear one. `steady`: the
    coefficient depends on parameters only, so it is constant during a run.
    """

    flat: FlatModel
    merged: Merged
    variables: Int[np.ndarray, " variables"]  # the representative node of each
    row: Int[np.ndarray, " entries"]
    variable: Int[np.ndarray, " entries"]
    order: Int[np.ndarray, " entries"]
    number: Float[np.ndarray, " entries"]
    strength: Int[np.ndarray, " entries"]
    steady: Bool[np.ndarray, " entries"]

    @property
    def sizes(self) -> np.ndarray:
        """The nominal size of each variable."""
        return self._sizes[0]

    @property
    def rate_sizes(self) -> np.ndarray:
        """The nominal size of the derivative of each variable."""
        return self._sizes[1]

    @ft.cached_property
    def _sizes(self) -> tuple[np.ndarray, np.ndarray]:
        return nominal_sizes(self.flat, self.merged, self.variables)

    @ft.cached_property
    def selects(self) -> np.ndarray:
        """The preference of each variable as a state: the rank of its `Select`, or 0."""
        leaves = self.flat.leaf_of_node[self.variables]
        return np.array([self.flat.leaves[leaf].declaration.select for leaf in leaves.tolist()], int)

    @property
    def families(self) -> list[Family]:
        return self.merged.families

    @ft.cached_property
    def offsets(self) -> np.ndarray:
        return np.concatenate([[0], np.cumsum([len(family.members) for family in self.families])]).astype(int)

    @property
    def n_rows(self) -> int:
        return int(self.offsets[-1])

    @property
    def n_variables(self) -> int:
        return len(self.variables)

    @ft.cached_property
    def family_of_row(self) -> np.ndarray:
        return np.repeat(np.arange(len(self.families)), np.diff(self.offsets))

    @ft.cached_property
    def number_of_node(self) -> list[int]:
        """The variable of a representative node, -1 for other nodes."""
        numbers = np.full(self.flat.n_nodes, -1)
        numbers[self.variables] = np.arange(self.n_variables)
        return numbers.tolist()

    @ft.cached_property
    def matchable(self) -> np.ndarray:
        """Entries whose equation has the shape of the variable and so can determine it."""
        flat = self.flat
        shape_of_leaf = [leaf.sizes for leaf in flat.leaves]
        codes: dict[tuple[int, ...], int] = {}
        leaf_code = np.array([codes.setdefault(sizes, len(codes)) for sizes in shape_of_leaf], dtype=int)
        family_code = np.array([codes.setdefault(f.template.shape, len(codes)) for f in self.families], dtype=int)
        variable_code = leaf_code[flat.leaf_of_node[self.variables]]
        return family_code[self.family_of_row[self.row]] == variable_code[self.variable]

    def place(self, row: int) -> tuple[Family, int]:
        family = int(self.family_of_row[row])
        return self.families[family], row - int(self.offsets[family])

    def row_name(self, row: int) -> str:
        family, inside = self.place(row)
        return family.name(inside, self.flat)

    def placed_name(self, variable: int) -> str:
        """The name of a variable, with the place in a text that declares it."""
        return self.flat.placed_name(int(self.variables[variable]))

    def variable_name(self, variable: int, order: int = 0) -> str:
        name = self.flat.node_name(int(self.variables[variable]))
        return name if order == 0 else f"der({name})" if order == 1 else f"der({name}, {order})"


def tabulate(flat: FlatModel, merged: Merged) -> Incidence:
    """Build the table. Occurrences that cancel, as in x - x, are removed."""
    families = merged.families
    rows, nodes, orders, numbers, strengths, steadies, places = [], [], [], [], [], [], []
    offset = 0
    for index, family in enumerate(families):
        count = len(family.members)
        for position in family.template.unknowns:
            number, strength, steady = _strength(family, position)
            rows.append(offset + np.arange(count))
            nodes.append(family.nodes[:, position])
            orders.append(np.full(count, family.template.inputs[position].order))
            numbers.append(number * family.signs[:, position])
            strengths.append(np.full(count, strength))
            steadies.append(np.full(count, steady))
            places.append(np.stack([np.full(count, index), np.arange(count), np.full(count, position)], axis=1))
        offset += count
    parts = (rows, nodes, orders, numbers, strengths, steadies)
    table = [np.concatenate(part) if part else np.zeros(0, int) for part in parts]
    place = np.concatenate(places) if places else np.zeros((0, 3), int)
    live = table[1] >= 0
    return _combined(flat, merged, [part[live] for part in table], place[live])


def _strength(family: Family, position: int) -> tuple[float, int, bool]:
    coefficient = family.template.coefficient(position)
    if coefficient is None:
        return np.nan, 0, False
    if coefficient.number is not None and coefficient.elementwise:
        return coefficient.number, 3, True
    return np.nan, 2 if coefficient.cannot_vanish else 1, not coefficient.on


def _combined(flat: FlatModel, merged: Merged, table: list[np.ndarray], place: np.ndarray) -> Incidence:
    row, node, order, number, strength, steady = table
    variables, variable = np.unique(node, return_inverse=True)
    key = (row * max(len(variables), 1) + variable) * 16 + order
    unique, inverse, counts = np.unique(key, return_inverse=True, return_counts=True)
    total = np.zeros(len(unique))
    np.add.at(total, inverse, number.astype(float))
    weakest = np.full(len(unique), 3)
    np.minimum.at(weakest, inverse, strength.astype(int))
    several = counts > 1
    weakest = np.where(several & (weakest < 3), np.minimum(weakest, 1), weakest)
    gone = several & (total == 0)
    all_steady = np.ones(len(unique), dtype=bool)
    np.logical_and.at(all_steady, inverse, steady.astype(bool))
    for family, inside, position in place[gone[inverse]].tolist():
        merged.families[family].nodes[inside, position] = ZERO
    first = np.zeros(len(unique), int)
    first[inverse[::-1]] = np.arange(len(inverse))[::-1]
    kept = first[~gone]
    used, renumbered = np.unique(variable[kept], return_inverse=True)
    return Incidence(
        flat, merged, variables[used].astype(int), row[kept].astype(int), renumbered.astype(int),
        order[kept].astype(int), total[~gone], weakest[~gone].astype(int), all_steady[~gone],
    )  # fmt: skip


class Range(NamedTuple):
    """The range of an alias, which equals the variable times `factor`."""

    sign: Sign
    factor: int


Ranges = tuple[Range, ...]


@ft.lru_cache(maxsize=64)
def ranges_of(table: Incidence) -> dict[int, dict[Range, int]]:
    """For each variable with declared ranges, the ranges with a node that declares each."""
    flat, merged, found = table.flat, table.merged, {}
    for leaf in flat.variable_leaves:
        sign = flat.leaves[leaf].declaration.sign
        if sign is None:
            continue
        for node in flat.leaves[leaf].nodes:
            representative = int(merged.representative[node])
            variable = table.number_of_node[representative] if representative >= 0 else -1
            if variable >= 0:
                found.setdefault(variable, {}).setdefault(Range(sign, int(merged.sign[node])), int(node))
    return found


def ranges_of_pair(table: Incidence, pair: Pair) -> Ranges:
    """The ranges of a variable; a derivative has none."""
    variable, order = pair
    return () if order else tuple(ranges_of(table).get(variable, ()))


def is_within(value: Numbers, ranges: Ranges) -> Array:
    """Whether each element of a variable lies in its ranges."""
    inside = jnp.ones(jnp.shape(value), bool)
    for sign, factor in ranges:
        inside &= sign.admits(factor * value)
    return inside


def within(value: Numbers, ranges: Ranges) -> Array:
    """The variable inside its ranges, NaN outside."""
    return jnp.where(is_within(value, ranges), value, jnp.nan)


def requirements(table: Incidence, pairs: list[Pair]) -> list[str]:
    """Declared ranges of variables as sentences for a message."""
    nodes = {node: sign for v, k in pairs if k == 0 for (sign, _), node in ranges_of(table).get(v, {}).items()}
    units = {node: table.flat.leaves[table.flat.leaf_of_node[node]].declaration.unit for node in nodes}
    return [f"{table.flat.node_name(node)} must be {sign.name} (unit {units[node]})" for node, sign in nodes.items()]
