"""Incidence table of the remaining equations: variables, derivative orders and coefficients."""

import dataclasses
import functools as ft

import numpy as np
from jaxtyping import Bool, Float, Int

from .aliases import ZERO, Family, Merged
from .flat_model import FlatModel
from .nominal import nominal_sizes

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
