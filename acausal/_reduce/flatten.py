"""Flattening: from a model to numbered variables, instances of component classes, and connection sets."""

import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import jax
import numpy as np

from .._declare.annotations import Declaration
from .._declare.array import Array
from .._declare.component import Component, Connection, EquationGroup
from .._declare.fields import dynamic_fields, join, parts_of
from .._declare.layout import complete
from .._declare.node import Node, Port, check_is_node, leaves_of, resolved_sizes
from .._declare.sizes import says_sizes, sizes_of, without_sizes
from .._errors import ModelError, ParameterError, complain
from .._jax_settings import check_precision
from .class_equations import is_held_to, own_records, required, shapes_held
from .flat_model import FlatLeaf, FlatModel, Instances, Kind
from .graph import connected
from .traced import TRUTH


def children(node: Node, path: str) -> Iterator[tuple[str, Any]]:
    """Parts of a node with their paths; the item of an array of components has a path that ends in `[]`."""
    for name, declaration in dynamic_fields(type(node)):
        if declaration is None:
            here = f"{path}[]" if isinstance(node, Array) else join(path, name)
            yield from parts_of(vars(node)[name], here)


class Joints:
    """Runs `connections()` on a view of the model with node numbers as leaves.

    A port takes part in a connection from outside, as part of a component, or from inside, if a composite connects
    its own port to its parts; the flow counts with opposite signs. So a flow node has two ends, 2 node + side.
    """

    def __init__(self, node_path: Callable[[int], str], *, split: bool = False) -> None:
        self._path = node_path
        self._split = split  # whether the elements of array variables are nodes of their own
        self.across: list[tuple[int, int]] = []
        self.flows: list[tuple[int, int]] = []
        self.joined_outside: list[np.ndarray] = []
        self.need: list[int] = []

    def visit(self, node: Node, path: str, *, is_root: bool = False) -> None:
        parts = list(children(node, path))
        own = {id(part) for _, part in parts if isinstance(part, Port)}
        if isinstance(node, Component):
            if type(node).connections is not Component.connections:
                for connection in node.connections():
                    try:
                        self._join(connection, own, path or type(node).__name__)
                    except ModelError as error:
                        complain(error)
            if not is_root:
                self._note_needs(parts)
        for part_path, part in parts:
            if isinstance(part, Component):
                self.visit(part, part_path)

    def _note_needs(self, parts: list[tuple[str, Any]]) -> None:
        for _, part in parts:
            if isinstance(part, Port) and type(part).needs_connection:
                self.need.extend(int(node) for node in np.ravel(_first_ids(part)))

    def _join(self, connection: Connection, own: set[int], where: str) -> None:
        ports = connection.ports
        if len(ports) < 2 or not all(isinstance(port, Port) for port in ports):
            kinds = ", ".join(type(port).__name__ for port in ports)
            raise ModelError(f"{where}: connect(...) takes two or more ports, got ({kinds}). Name the port of a part.")
        head = ports[0]
        sides = [1 if id(port) in own else 0 for port in ports]
        for port, side in zip(ports, sides, strict=True):
            if side == 0:
                self.joined_outside.append(np.ravel(_first_ids(port)))
        for port, side in zip(ports[1:], sides[1:], strict=True):
            self._pair(head, sides[0], port, side, where)

    def _pair(self, a: Port, side_a: int, b: Port, side_b: int, where: str) -> None:
        self._check_alike(a, b, where)
        for name, declaration in dynamic_fields(type(a)):
            own = len(declaration.sizes or ()) if declaration is not None and self._split else 0
            left, right = _spread(vars(a)[name], vars(b)[name], where.count("[]"), own)
            if np.shape(left) != np.shape(right):
                raise ModelError(
                    f"{where}: {self._name(a)} and {self._name(b)} stand for {np.size(left)} and {np.size(right)} "
                    "ports. Select equally many members of both arrays, or a single one."
                )
            is_flow = declaration is not None and declaration.role == "flow"
            pairs = np.ravel(left).tolist(), np.ravel(right).tolist()
            if is_flow:
                self.flows += [(2 * i + side_a, 2 * j + side_b) for i, j in zip(*pairs, strict=True)]
            else:
                self.across += zip(*pairs, strict=True)

    def _check_alike(self, a: Port, b: Port, where: str) -> None:
        alike = type(a) is type(b) or _family(type(a)) & _family(type(b))
        if not alike:
            raise ModelError(
                f"{where}: {self._name(a)} is a {type(a).__name__} and {self._name(b)} a {type(b).__name__}; only "
                "ports of one kind can be connected. Put a component between them that converts one into the other."
            )

    def _name(self, port: Port) -> str:
        return self._path(int(np.ravel(_first_ids(port))[0])).rpartition(".")[0]

    def resolve(self, flow_nodes: np.ndarray) -> tuple[np.ndarray, list]:
        """Pairs of merged nodes, and the sets of signed flows that sum to zero."""
        connected = set(np.concatenate(self.joined_outside).tolist()) if self.joined_outside else set()
        for node in self.need:
            if node not in connected:
                port = self._path(node).rpartition(".")[0]
                complain(ModelError(f"{port} is not connected: it needs a connection that determines its value."))
        across, edges = (np.array(pairs, int).reshape(-1, 2) for pairs in (self.across, self.flows))
        ends = np.unique(np.concatenate([2 * flow_nodes, np.ravel(edges)]))
        return across, _flow_sets(ends, edges)


def _spread(a: np.ndarray, b: np.ndarray, around: int, own: int) -> tuple[np.ndarray, np.ndarray]:
    """Node numbers of two ports, those of a single port repeated for each member of an array.

    `around` is the number of axes of arrays around the connecting component; the last `own` axes are those of a
    variable.
    """
    few, many = (a, b) if np.ndim(a) <= np.ndim(b) else (b, a)
    if np.ndim(few) == np.ndim(many) or np.ndim(few) != around + own:
        return a, b
    single = np.expand_dims(few, tuple(range(around, around + np.ndim(many) - np.ndim(few))))
    each = np.broadcast_to(single, np.shape(many))
    return (each, b) if few is a else (a, each)


def _flow_sets(ends: np.ndarray, edges: np.ndarray) -> list[tuple[tuple[int, ...], tuple[int, ...]]]:
    if len(ends) == 0:
        return []
    n_sets, label = connected(np.searchsorted(ends, edges), len(ends))
    order = np.argsort(label, kind="stable")
    bounds = np.searchsorted(label[order], np.arange(n_sets + 1))
    members = ends[order].tolist()
    sets = []
    for start, stop in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        nodes = tuple(end >> 1 for end in members[start:stop])
        sets.append((nodes, tuple(-1 if end & 1 else 1 for end in members[start:stop])))
    return sorted(sets)


def _family(cls: type[Port]) -> set[type]:
    """Common partial bases of connectable ports of different classes, such as `Signal` for `Input` and `Output`."""
    return {base for base in cls.__mro__ if issubclass(base, Port) and base not in (Port, cls)}


def _first_ids(port: Port) -> np.ndarray:
    name, _ = dynamic_fields(type(port))[0]
    return vars(port)[name]


def flatten(model: Component, *, split: bool = False) -> FlatModel:
    """Number the leaves of `model`, group its components by kind and resolve its connections.

    With `split`, each element of an array variable is a node of its own.

    Raises `ModelError` for a leaf of the wrong shape, a connection between unlike ports, or an open port that needs
    a connection.
    """
    check_precision()
    check_is_node(model)
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
    across, flow_sets = joined.resolve(walker.flows())
    instances, composites = list(walker.instances.values()), list(walker.composites.values())
    for holder in instances + composites:
        for path in holder.paths:
            for sentence in required(holder.kind).never:
                complain(ParameterError(f"{join(path, sentence)}."))
    for holder in instances:
        walker.leaves += _truths(holder, len(walker.leaves))
    name = type(model).__name__
    starters = list(walker.starters.values())
    return FlatModel(
        structure, walker.leaves, walker.n_nodes, instances, composites, starters, across, flow_sets, name,
        walker.places, split,
    )  # fmt: skip


def _truths(instances: Instances, first: int) -> list[FlatLeaf]:
    """The leaves of the truths that `ifelse` holds in components of a kind, which become its last slots."""
    kind = instances.kind
    shapes = shapes_held(kind)
    if not shapes:
        return []
    names = tuple(f"_held[{i}]" for i in range(len(shapes)))
    declarations = (TRUTH,) * len(shapes)
    instances.kind = dataclasses.replace(
        kind, sizes=kind.sizes + shapes, declarations=kind.declarations + declarations, names=kind.names + names
    )
    instances.first_truth = [first + i * len(shapes) for i in range(len(instances.paths))]
    return [
        FlatLeaf(join(path, f"_held{i}"), TRUTH, stack, shape, 0, None)
        for path, stack in zip(instances.paths, instances.stacks, strict=True)
        for i, shape in enumerate(shapes)
    ]


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
        self.places: dict[str, str] = {}

    def visit(self, node: Node, path: str, stack: tuple[int, ...]) -> None:
        if not isinstance(node, Node):
            raise ModelError(
                f"{path or 'The model'} is a number, but is declared as a part: give it a Component, Port or Record."
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
        for group in node.equation_groups if isinstance(node, Component) else ():
            self._note_group(group, path, stack, first_leaf)
        if isinstance(node, Component):
            self.places.update((join(path, name), place) for name, place in node.declared_in.items())
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
        declared = resolved_sizes(node, declaration)
        sizes = shape[len(stack) :] if declared is None else declared
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

    def _note_group(self, group: EquationGroup, path: str, stack: tuple[int, ...], first_leaf: int) -> None:
        states_start = type(group.form).initial_equations is not Component.initial_equations
        among = self.starters if states_start else self.instances
        for row, where in zip(group.leaves, group.paths, strict=True):
            leaves = [first_leaf + leaf for leaf in row]
            self._note_leaves(among, group.form, join(path, where) if where else path, stack, leaves)

    def _note_leaves(
        self,
        among: dict[Kind, Instances],
        form: Component,
        path: str,
        stack: tuple[int, ...],
        leaves: Sequence[int],
    ) -> None:
        own = [self.leaves[leaf] for leaf in leaves]
        sizes = tuple(leaf.stack[len(stack) :] + leaf.sizes for leaf in own)
        names = tuple(name for name, _ in dynamic_fields(type(form)))
        structure = jax.tree_util.tree_structure(form)
        kind = Kind(structure, sizes, type(form), tuple(leaf.declaration for leaf in own), names, 0)
        found = among.setdefault(kind, Instances(kind, [], [], []))
        found.paths.append(path)
        found.stacks.append(stack)
        found.own_leaves.append(leaves)

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
        found.own_leaves.append(range(first_leaf, len(self.leaves)))

    def flows(self) -> np.ndarray:
        """The nodes that are through variables."""
        ranges = [leaf.first + np.arange(leaf.count) for leaf in self.leaves if leaf.declaration.role == "flow"]
        return np.concatenate(ranges) if ranges else np.zeros(0, int)

    def node_path(self, node: int) -> str:
        variables = [leaf for leaf in self.leaves if leaf.declaration.is_variable]
        leaf = next(leaf for leaf in variables if node in leaf.nodes)
        return leaf.name(node - leaf.first)
