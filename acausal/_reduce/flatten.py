"""From a model to numbered variables, instances of component classes, and connection sets."""

import dataclasses
import functools as ft
import math
from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import jax
import numpy as np
from jaxtyping import Int

from .._declare.annotations import Declaration
from .._declare.array import Array, deepened
from .._declare.component import Component
from .._declare.fields import dynamic_fields, join, parts_of
from .._declare.layout import complete
from .._declare.node import Node, Port, leaves_of
from .._declare.sizes import says_sizes, sizes_of, without_sizes
from .._errors import ModelError, ParameterError, complain
from .connections import Joints
from .required import is_held_to, own_records, required


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
    port: type[Port] | None  # the class of the port that it is a variable of
    nominal: float | None = None  # size that the model gives

    @property
    def count(self) -> int:
        return math.prod(self.stack)

    @property
    def in_port(self) -> bool:
        return self.port is not None

    def name(self, index: int) -> str:
        """The path of one stacked member: `inertias[].w` and 3 give `inertias[3].w`."""
        return indexed(self.path, self.stack, index)


def indexed(path: str, stack: tuple[int, ...], index: int) -> str:
    """A path with the numbers of a stacked member in its brackets."""
    pieces = path.split("[]")
    numbers = np.unravel_index(index, stack) if stack else ()
    return pieces[0] + "".join(f"[{n}]{piece}" for n, piece in zip(numbers, pieces[1:], strict=True))


@dataclasses.dataclass(frozen=True)
class Kind:
    """A component class with its static structure: what its equations are traced from, once."""

    structure: Hashable  # jax tree structure of one component
    sizes: tuple[tuple[int, ...], ...]  # shape of each of its leaves
    cls: type[Component] = dataclasses.field(compare=False)
    declarations: tuple[Declaration, ...] = dataclasses.field(compare=False)
    names: tuple[str, ...] = dataclasses.field(compare=False)  # of the leaves, within the component
    depth: int  # of arrays around it, where it holds arrays itself; else 0

    def component(self, leaves: Sequence[Any]) -> Any:
        """One component of this kind with the given leaves."""
        return deepened(self.structure.unflatten(leaves), -self.depth)  # pyright: ignore[reportAttributeAccessIssue]


@dataclasses.dataclass(eq=False)
class Instances:
    """All components of one kind: for each, its path and the nodes and leaves behind the kind's slots."""

    kind: Kind
    paths: list[str]  # one for each member
    stacks: list[tuple[int, ...]]
    first_leaf: list[int]

    @ft.cached_property
    def counts(self) -> np.ndarray:
        return np.array([math.prod(stack) for stack in self.stacks])

    @property
    def total(self) -> int:
        return int(self.counts.sum())

    def place(self, index: int) -> tuple[int, int]:
        """The entry of `paths` that an instance belongs to, and its number within that stack."""
        ends = np.cumsum(self.counts)
        entry = int(np.searchsorted(ends, index, side="right"))
        return entry, index - int(ends[entry] - self.counts[entry])

    def name(self, index: int) -> str:
        """The path of the `index`-th instance, stacked members counted one by one."""
        entry, inside = self.place(index)
        return indexed(self.paths[entry], self.stacks[entry], inside)


@dataclasses.dataclass(eq=False)
class FlatModel:
    """Numbered leaves and nodes of a model, its component instances, and the outcome of its connections.

    `across` lists pairs of nodes that are merged. A row of `flow_sets` lists (node, sign) whose signed sum is zero.
    """

    structure: Any
    leaves: list[FlatLeaf]
    n_nodes: int
    instances: list[Instances]
    composites: list[Instances]  # those without equations that parameters have to meet requirements in
    starters: list[Instances]  # those that state initial equations
    across: Int[np.ndarray, "m 2"]
    flow_sets: list[tuple[tuple[int, ...], tuple[int, ...]]]
    name: str  # the class of the model
    split: bool = False  # whether the elements of array variables are nodes of their own

    @ft.cached_property
    def holders(self) -> list[Instances]:
        """All whose parameters are read: the instances first."""
        return self.instances + self.composites

    @ft.cached_property
    def variable_leaves(self) -> list[int]:
        return [i for i, leaf in enumerate(self.leaves) if leaf.declaration.is_variable]

    def is_variable(self, leaf: int) -> bool:
        return self.leaves[leaf].declaration.is_variable

    @property
    def root_fields(self) -> tuple[str, ...]:
        """Names of the model's own parts, parameters and variables."""
        return tuple(dict.fromkeys(leaf.path.partition(".")[0].partition("[")[0] for leaf in self.leaves))

    @ft.cached_property
    def discrete_leaves(self) -> list[int]:
        return [i for i, leaf in enumerate(self.leaves) if leaf.declaration.role == "discrete"]

    @ft.cached_property
    def firsts(self) -> np.ndarray:
        """First node of each leaf, -1 for a parameter."""
        return np.array([leaf.first if leaf.declaration.is_variable else -1 for leaf in self.leaves], dtype=int)

    @ft.cached_property
    def leaf_of_node(self) -> np.ndarray:
        counts = [self.leaves[i].count for i in self.variable_leaves]
        return np.repeat(np.array(self.variable_leaves, dtype=int), counts)

    @ft.cached_property
    def leaf_names(self) -> dict[str, tuple[int, int]]:
        """The names of all variables and parameters: which leaf each belongs to, and which of its stacked members."""
        return {leaf.name(i): (number, i) for number, leaf in enumerate(self.leaves) for i in range(leaf.count)}

    def node_name(self, node: int) -> str:
        leaf = self.leaves[self.leaf_of_node[node]]
        return leaf.name(node - leaf.first)

    def nodes(self, instances: Instances) -> Int[np.ndarray, "instances slots"]:
        """The first node behind each slot of each instance; -1 where the slot is a parameter."""
        rows = []
        slots = np.arange(len(instances.kind.sizes))
        for first_leaf, count in zip(instances.first_leaf, instances.counts, strict=True):
            firsts = self.firsts[first_leaf + slots]
            elements = np.array([self.leaves[first_leaf + slot].count for slot in slots], dtype=int) // count
            rows.append(np.where(firsts < 0, -1, firsts + np.arange(count)[:, None] * elements))
        return np.concatenate(rows)


def flatten(model: Component, *, split: bool = False) -> FlatModel:
    """Number the leaves of `model`, group its components by kind and resolve its connections.

    With `split`, each element of an array variable is a node of its own.

    Raises `ModelError` for a leaf of the wrong shape, a connection between unlike ports, or an open port that needs
    a connection.
    """
    model = complete(model)
    walker = _Walker(split, says_sizes(model))
    walker.visit(model, "", ())
    leaves, structure = jax.tree_util.tree_flatten(model)
    assert len(leaves) == len(walker.leaves)
    ids = [
        leaf.first + np.arange(leaf.count).reshape(leaf.stack) if leaf.declaration.is_variable
        else np.full(leaf.stack, -1)
        for leaf in walker.leaves
    ]  # fmt: skip
    view = structure.unflatten(ids)
    joined = Joints(walker.node_path, split=split)
    joined.visit(view, "", is_root=True)
    across, flow_sets = joined.resolve(walker.flows(), walker.n_nodes)
    instances, composites = list(walker.instances.values()), list(walker.composites.values())
    for holder in instances + composites:
        for path in holder.paths:
            for sentence in required(holder.kind).never:
                complain(ParameterError(f"{join(path, sentence)}."))
    name = type(model).__name__
    starters = list(walker.starters.values())
    return FlatModel(
        structure, walker.leaves, walker.n_nodes, instances, composites, starters, across, flow_sets, name, split
    )


class _Walker:
    """Collects leaves, in pytree order, and component instances."""

    def __init__(self, split: bool, has_sizes: bool) -> None:
        self.split = split
        self.has_sizes = has_sizes
        self.leaves: list[FlatLeaf] = []
        self.instances: dict[Kind, Instances] = {}
        self.composites: dict[Kind, Instances] = {}
        self.starters: dict[Kind, Instances] = {}
        self.n_nodes: int = 0

    def visit(self, node: Node, path: str, stack: tuple[int, ...]) -> None:
        if not isinstance(node, Node):
            raise ModelError(
                f"{path or 'The model'} holds a number, but is declared as a part: give it a Component, Port or Record."
            )
        first_leaf = len(self.leaves)
        below = (*stack, node.n) if isinstance(node, Array) else stack
        for name, declaration in dynamic_fields(type(node)):
            if declaration is not None:
                self._leaf(node, name, declaration, path, stack)
                continue
            here = f"{path}[]" if isinstance(node, Array) else join(path, name)
            for part_path, part in parts_of(vars(node)[name], here):
                self.visit(part, part_path, below)
        if isinstance(node, Component) and type(node).equations is not Component.equations:
            self._note(self.instances, node, path, stack, first_leaf)
        elif isinstance(node, Component) and any(is_held_to(part) for _, part in own_records(node)):
            self._note(self.composites, node, path, stack, first_leaf)
        if isinstance(node, Component) and type(node).initial_equations is not Component.initial_equations:
            self._note(self.starters, node, path, stack, first_leaf)
        if sizes := sizes_of(node):
            self._size(node, sizes, first_leaf)

    def _size(self, node: Node, sizes: Mapping[str, float], first_leaf: int) -> None:
        for i, leaf in enumerate(leaves_of(node), start=first_leaf):
            if leaf.path in sizes:
                self.leaves[i] = dataclasses.replace(self.leaves[i], nominal=sizes[leaf.path])

    def _leaf(self, node: Node, name: str, declaration: Declaration, path: str, stack: tuple[int, ...]) -> None:
        where = join(path, name)
        value = vars(node)[name]
        shape = () if isinstance(value, float) else np.shape(value)
        sizes = shape[len(stack) :] if declaration.sizes is None else _sizes(node, declaration)
        is_uniform = declaration.role != "param" and shape == ()
        if not is_uniform and shape != (*stack, *sizes):
            complain(
                ModelError(
                    f"{where} has shape {shape}, but is declared with shape {(*stack, *sizes)}. For several "
                    "components, use repeat(...) or stack(...)."
                )
            )
        if self.split and declaration.is_variable:
            where, stack, sizes = where + "[]" * len(sizes), (*stack, *sizes), ()
        port = type(node) if isinstance(node, Port) else None
        self.leaves.append(FlatLeaf(where, declaration, stack, sizes, self.n_nodes, port))
        if declaration.is_variable:
            self.n_nodes += self.leaves[-1].count

    def _note(
        self, among: dict[Kind, Instances], node: Component, path: str, stack: tuple[int, ...], first_leaf: int
    ) -> None:
        own = self.leaves[first_leaf:]
        kind = Kind(
            jax.tree_util.tree_structure(without_sizes(node) if self.has_sizes else node),
            tuple(leaf.stack[len(stack) :] + leaf.sizes for leaf in own),
            type(node),
            tuple(leaf.declaration for leaf in own),
            tuple(leaf.path.removeprefix(f"{path}.") for leaf in own),
            len(stack) if any(len(leaf.stack) > len(stack) for leaf in own) else 0,
        )
        found = among.setdefault(kind, Instances(kind, [], [], []))
        found.paths.append(path)
        found.stacks.append(stack)
        found.first_leaf.append(first_leaf)

    def flows(self) -> np.ndarray:
        """The nodes that are through variables."""
        ranges = [leaf.first + np.arange(leaf.count) for leaf in self.leaves if leaf.declaration.role == "flow"]
        return np.concatenate(ranges) if ranges else np.zeros(0, int)

    def node_path(self, node: int) -> str:
        variables = [leaf for leaf in self.leaves if leaf.declaration.is_variable]
        leaf = next(leaf for leaf in variables if leaf.first <= node < leaf.first + leaf.count)
        return leaf.name(node - leaf.first)


def _sizes(node: Node, declaration: Declaration) -> tuple[int, ...]:
    assert declaration.sizes is not None
    return tuple(getattr(node, size) if isinstance(size, str) else size for size in declaration.sizes)
