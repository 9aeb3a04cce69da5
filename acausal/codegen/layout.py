"""The positions of all numbers of a model in the arrays of its C struct."""

import dataclasses
import functools as ft
import math
from typing import NamedTuple

import numpy as np

from .._evaluate.system import System
from .._reduce.incidence import Pair
from .._unit_check.signal_units import unit_of_leaf

# The arrays: parameters, discrete variables, values (the states first), and guesses of iterations.
Space = str  # "p", "d", "v", "guess", "t", or "" for a value that is always 0


class Places(NamedTuple):
    """An operand of a call: the first element of each member in an array of the struct, and its sign."""

    space: Space
    firsts: np.ndarray
    sign: int = 1


@dataclasses.dataclass(frozen=True)
class Quantity:
    """A named number or array of the model: its first position in the array that holds it, and its value there."""

    name: str
    unit: str
    place: int
    value: np.ndarray

    @property
    def size(self) -> int:
        return self.value.size


@dataclasses.dataclass(frozen=True, eq=False)
class Numbering:
    """Positions of the parameters, discrete variables and values of a system."""

    system: System

    @ft.cached_property
    def params(self) -> dict[int, int]:
        """The first position of each parameter leaf in p."""
        return self._stacked([i for i, leaf in enumerate(self._leaves) if leaf.declaration.role == "param"])

    @ft.cached_property
    def discrete(self) -> dict[int, int]:
        """The first position of each discrete leaf in d."""
        return self._stacked(list(self.system.flat.discrete_leaves))

    def _stacked(self, leaves: list[int]) -> dict[int, int]:
        sizes = [self.size(leaf) for leaf in leaves]
        return dict(zip(leaves, np.cumsum([0, *sizes]).tolist(), strict=False))

    @property
    def _leaves(self) -> list:
        return self.system.flat.leaves

    def size(self, leaf: int) -> int:
        """The number of elements of a leaf."""
        return self._leaves[leaf].count * math.prod(self._leaves[leaf].sizes)

    @ft.cached_property
    def n_params(self) -> int:
        return sum(map(self.size, self.params))

    @ft.cached_property
    def n_discrete(self) -> int:
        return sum(map(self.size, self.discrete))

    @ft.cached_property
    def _offsets(self) -> np.ndarray:
        """The first position of each segment in v."""
        plan = self.system.plan
        sizes = [int(plan.starts[-1])]
        for group in plan.groups:
            sizes += [math.prod(shape) * len(group.uses) for shape in group.program.shapes]
        return np.cumsum([0, *sizes])

    @property
    def n_values(self) -> int:
        return int(self._offsets[-1])

    def place(self, pair: Pair) -> int:
        """The first position of a state or unknown in v."""
        slot = self.system.plan.places[pair]
        return int(self._offsets[slot.segment]) + slot.start

    def pair_at(self, place: int) -> tuple[Pair, int]:
        """The pair whose value is at a place in v, and the element of it."""
        number = int(np.searchsorted([start for start, _ in self._starts], place, side="right")) - 1
        start, pair = self._starts[number]
        return pair, place - start

    @ft.cached_property
    def _starts(self) -> list[tuple[int, Pair]]:
        return sorted((self.place(pair), pair) for pair in self.system.plan.places)

    def values(self, pairs: list[Pair]) -> Places:
        return Places("v", np.array([self.place(pair) for pair in pairs]))

    def memory(self, pairs: list[Pair]) -> Places:
        """The guesses of unknowns that an iteration searches."""
        carried, plan = self.system.carried, self.system.plan
        firsts = np.cumsum([0, *(plan.size(variable) for variable, _ in carried.memory)])
        found = dict(zip(carried.memory, firsts.tolist(), strict=False))
        return Places("guess", np.array([found[pair] for pair in pairs]))

    def members(self, key: tuple[int, int], members: np.ndarray) -> Places:
        """A parameter or discrete variable of some members of a component kind."""
        kind, slot = key
        holder = self.system.flat.holders[kind]
        is_discrete = self.system.carried.is_discrete(key)
        start = self.discrete if is_discrete else self.params
        size = math.prod(holder.kind.sizes[slot])
        places = [holder.place(int(member)) for member in members]
        firsts = [start[holder.leaf(entry, slot)] + inside * size for entry, inside in places]
        return Places("d" if is_discrete else "p", np.array(firsts))

    def leaf(self, leaf: int) -> list[tuple[Places, int]]:
        """The elements of a leaf: of each member the place of its first element, and their number."""
        own = self._leaves[leaf]
        size = math.prod(own.sizes)
        if leaf in self.params or leaf in self.discrete:
            space, start = ("p", self.params[leaf]) if leaf in self.params else ("d", self.discrete[leaf])
            return [(Places(space, np.array([start])), self.size(leaf))]
        return [(self.node(node), size) for node in own.nodes]

    def node(self, node: int) -> Places:
        """The value of a variable of the flattened model."""
        pair, sign = self.system.pair_of_node(node)
        if pair is None:
            return Places("t" if sign else "", np.array([0]), sign or 1)
        return self.values([pair])._replace(sign=sign)

    def unit(self, variable: int) -> str:
        """The unit of a variable, declared or that of the signal."""
        flat = self.system.flat
        return unit_of_leaf(flat, int(flat.leaf_of_node[self.system.ordered.table.variables[variable]]))

    def quantities(self, leaves: dict[int, int], values: dict[int, np.ndarray]) -> list[Quantity]:
        """The named numbers of parameters or discrete variables: one for each component."""
        found = []
        for number, start in leaves.items():
            leaf, unit = self._leaves[number], unit_of_leaf(self.system.flat, number)
            rows = np.reshape(np.broadcast_to(values[number], leaf.stack + leaf.sizes), (leaf.count, -1))
            for i, row in enumerate(rows):
                name, place = leaf.name(i), start + i * rows.shape[1]
                found.append(Quantity(name, unit, place, np.asarray(row, float)))
        return found
