"""The flat model, the result of `flatten`: numbered variables, instances of component classes, and connection sets."""

import dataclasses
import functools as ft
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from jax.tree_util import PyTreeDef
from jaxtyping import Int

from .._declare.annotations import Declaration
from .._declare.array import deepened
from .._declare.component import Component
from .._declare.node import Port

_INDICES = re.compile(r"(\[[\d,]+\])+$")


@dataclasses.dataclass(frozen=True)
class FlatLeaf:
    """A leaf of the model: `stack` is the shape of the arrays of components around it, `sizes` its own shape.

    A variable leaf owns the nodes `first .. first + prod(stack) - 1`, one for each stacked component.
    """

    path: str
    declaration: Declaration
    stack: tuple[int, ...]
    sizes: tuple[int, ...]
    first: int
    port: type[Port] | None  # the class of its port
    nominal: float | None = None  # nominal size given by the model

    @property
    def count(self) -> int:
        return math.prod(self.stack)

    @property
    def nodes(self) -> range:
        """The nodes of a variable leaf."""
        return range(self.first, self.first + self.count)

    @property
    def in_port(self) -> bool:
        return self.port is not None

    def name(self, index: int) -> str:
        """The path of one stacked member: `inertias[3].w` for `inertias[].w` and 3. Brackets at the end of a path are
        those of the elements of an array variable.
        """
        whole = self.path.rstrip("[]")
        outer, place = whole.count("[]"), place_of(index, self.stack)
        return with_indices(whole, place[:outer]) + self.declaration.element(place[outer:])


def indexed(path: str, stack: tuple[int, ...], index: int) -> str:
    """A path with the indices of a stacked member in its brackets."""
    return with_indices(path, place_of(index, stack))


def place_of(index: int, shape: tuple[int, ...]) -> tuple[int, ...]:
    """The indices of an element that the flat array has at an index."""
    return tuple(int(i) for i in np.unravel_index(index, shape)) if shape else ()


def with_indices(path: str, numbers: Sequence[int]) -> str:
    """A path with numbers in its brackets."""
    pieces = path.split("[]")
    return pieces[0] + "".join(f"[{n}]{piece}" for n, piece in zip(numbers, pieces[1:], strict=True))


@dataclasses.dataclass(frozen=True)
class Kind:
    """A component class with its static structure. Its equations are traced once."""

    structure: PyTreeDef  # of one component
    sizes: tuple[tuple[int, ...], ...]  # shape of each of its leaves
    cls: type[Component] = dataclasses.field(compare=False)
    declarations: tuple[Declaration, ...] = dataclasses.field(compare=False)
    names: tuple[str, ...] = dataclasses.field(compare=False)  # of the leaves, within the component
    depth: int  # of arrays around a component that holds arrays itself; otherwise 0

    @property
    def n_own(self) -> int:
        """The number of slots for leaves of the component; the truths that `ifelse` holds follow."""
        return self.structure.num_leaves

    @property
    def own(self) -> "Kind":
        """The kind without the truths that `ifelse` holds."""
        n = self.n_own
        if len(self.sizes) == n:
            return self
        return dataclasses.replace(self, sizes=self.sizes[:n], declarations=self.declarations[:n], names=self.names[:n])

    def component(self, leaves: Sequence[Any]) -> Any:
        """One component of this kind with the given leaves."""
        return deepened(self.structure.unflatten(leaves[: self.n_own]), -self.depth)


@dataclasses.dataclass(eq=False)
class Instances:
    """All components of one kind: paths, and the nodes and leaves of the kind's slots.

    `own_leaves` holds, for each entry of `paths`, the numbers of the leaves of the component, one for each slot.
    """

    kind: Kind
    paths: list[str]  # one for each stack
    stacks: list[tuple[int, ...]]
    own_leaves: list[Sequence[int]]
    first_truth: list[int] = dataclasses.field(default_factory=list)  # the leaves of the truths that `ifelse` holds

    def leaf(self, entry: int, slot: int) -> int:
        """The number of the leaf of a slot of an entry of `paths`."""
        n = self.kind.n_own
        return self.own_leaves[entry][slot] if slot < n else self.first_truth[entry] + slot - n

    @ft.cached_property
    def counts(self) -> np.ndarray:
        return np.array([math.prod(stack) for stack in self.stacks])

    @property
    def total(self) -> int:
        return int(self.counts.sum())

    def place(self, index: int) -> tuple[int, int]:
        """The entry of `paths` of an instance, and its index within that stack."""
        ends = np.cumsum(self.counts)
        entry = int(np.searchsorted(ends, index, side="right"))
        return entry, index - int(ends[entry] - self.counts[entry])

    def name(self, index: int) -> str:
        """The path of the `index`-th instance, where stacked members count one by one."""
        entry, inside = self.place(index)
        return indexed(self.paths[entry], self.stacks[entry], inside)


@dataclasses.dataclass(eq=False)
class FlatModel:
    """Numbered leaves and nodes of a model, its component instances, and its connections.

    After the leaves of the model come those of the truths that `ifelse` holds: discrete variables without a place in
    the model.

    `across` lists pairs of nodes that are merged. A row of `flow_sets` lists (node, sign) whose signed sum is zero.
    `places` are the places in a text that declare leaves, by their paths.
    """

    structure: PyTreeDef
    leaves: list[FlatLeaf]
    n_nodes: int
    instances: list[Instances]
    composites: list[Instances]  # instances without equations, with requirements on parameters
    starters: list[Instances]  # instances with initial equations
    across: Int[np.ndarray, "m 2"]
    flow_sets: list[tuple[tuple[int, ...], tuple[int, ...]]]
    name: str  # the class of the model
    places: Mapping[str, str]
    split: bool = False  # whether each element of an array variable is a node

    @ft.cached_property
    def holders(self) -> list[Instances]:
        """All instances whose parameters are read; those with equations come first."""
        return self.instances + self.composites

    @ft.cached_property
    def variable_leaves(self) -> list[int]:
        return [i for i, leaf in enumerate(self.leaves) if leaf.declaration.is_variable]

    def is_variable(self, leaf: int) -> bool:
        return self.leaves[leaf].declaration.is_variable

    @property
    def own_leaves(self) -> list[FlatLeaf]:
        """The leaves of the model itself."""
        return self.leaves[: self.structure.num_leaves]

    @property
    def root_fields(self) -> tuple[str, ...]:
        """Names of the model's own parts, parameters and variables."""
        return tuple(dict.fromkeys(leaf.path.partition(".")[0].partition("[")[0] for leaf in self.own_leaves))

    @ft.cached_property
    def discrete_leaves(self) -> list[int]:
        return [i for i, leaf in enumerate(self.leaves) if leaf.declaration.role == "discrete"]

    @ft.cached_property
    def firsts(self) -> np.ndarray:
        """First node of each leaf, -1 for a parameter."""
        return np.array([leaf.first if leaf.declaration.is_variable else -1 for leaf in self.leaves], dtype=int)

    @ft.cached_property
    def _leaf_counts(self) -> np.ndarray:
        return np.array([leaf.count for leaf in self.leaves], dtype=int)

    @ft.cached_property
    def leaf_of_node(self) -> np.ndarray:
        counts = [self.leaves[i].count for i in self.variable_leaves]
        return np.repeat(np.array(self.variable_leaves, dtype=int), counts)

    @ft.cached_property
    def leaf_names(self) -> dict[str, tuple[int, int]]:
        """The names of all variables and parameters, with the leaf and the stacked member."""
        return {leaf.name(i): (number, i) for number, leaf in enumerate(self.own_leaves) for i in range(leaf.count)}

    @ft.cached_property
    def split_names(self) -> dict[str, int]:
        """The names of array variables whose elements are nodes of their own, with their leaves."""
        names = {leaf.path.rstrip("[]"): number for number, leaf in enumerate(self.own_leaves) if self.split}
        return {name: number for name, number in names.items() if "[]" not in name and name not in self.leaf_names}

    def find(self, name: str) -> tuple[int, tuple[int, ...]] | None:
        """The leaf that a name stands for, and the index of a stacked member or element in its last axes."""
        if name in self.split_names:
            return self.split_names[name], ()
        number, member = self.leaf_names.get(name) or self.leaf_names.get(_INDICES.sub("", name), (-1, 0))
        if number < 0:
            return None
        leaf = self.leaves[number]
        place = place_of(member, leaf.stack)
        if name in self.leaf_names:
            return number, place
        elements = {leaf.name(member) + leaf.declaration.element(one): one for one in np.ndindex(*leaf.sizes)}
        return (number, (*place, *elements[name])) if name in elements else None

    @ft.cached_property
    def unconnected(self) -> frozenset[int]:
        """The flows of ports to which nothing is connected."""
        return frozenset(nodes[0] for nodes, _ in self.flow_sets if len(nodes) == 1)

    def node_name(self, node: int) -> str:
        leaf = self.leaves[self.leaf_of_node[node]]
        return leaf.name(node - leaf.first)

    def placed_name(self, node: int) -> str:
        """The name of a node, with the place in a text that declares it."""
        place = self.places.get(self.leaves[self.leaf_of_node[node]].path.rstrip("[]"))
        return f"{self.node_name(node)} ({place})" if place else self.node_name(node)

    def nodes(self, instances: Instances) -> Int[np.ndarray, "instances slots"]:
        """The first node of each slot of each instance; -1 for a parameter."""
        slots, counts = np.arange(instances.kind.n_own), instances.counts
        leaves = np.array(instances.own_leaves, int).reshape(-1, len(slots))
        elements = self._leaf_counts[leaves] // counts[:, None]
        inside = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        firsts = np.repeat(self.firsts[leaves], counts, axis=0)
        own = np.where(firsts < 0, -1, firsts + inside[:, None] * np.repeat(elements, counts, axis=0))
        return np.pad(own, ((0, 0), (0, len(instances.kind.sizes) - len(slots))), constant_values=-1)


def reference_of(leaves: Iterable[FlatLeaf]) -> str:
    """The components that the ports of these leaves name as their reference, such as "a Ground"."""
    named = dict.fromkeys(leaf.port.reference for leaf in leaves if leaf.port is not None and leaf.port.reference)
    return " or ".join(named) or "a component that fixes the across variable of one of its ports"
