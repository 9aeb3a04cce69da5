"""Flattening: from a model to numbered variables, instances of component classes, and connection sets."""

import dataclasses
from collections.abc import Mapping, Sequence

import jax
import numpy as np

from .._declare.annotations import Declaration
from .._declare.array import Array
from .._declare.component import Component, EquationGroup
from .._declare.fields import dynamic_fields, join, parts_of
from .._declare.layout import complete
from .._declare.node import Node, Port, check_is_node, leaves_of, resolved_sizes
from .._declare.sizes import says_sizes, sizes_of, without_sizes
from .._errors import ModelError, ParameterError, complain
from .connections import Joints
from .flat_model import FlatLeaf, FlatModel, Instances, Kind
from .held import TRUTH
from .kind_requirements import is_held_to, own_records, required
from .stated import shapes_held


def flatten(model: Component, *, split: bool = False) -> FlatModel:
    """Number the leaves of `model`, group its components by kind and resolve its connections.

    With `split`, each element of an array variable is a node of its own.

    Raises `ModelError` for a leaf of the wrong shape, a connection between unlike ports, or an open port that needs
    a connection.
    """
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
        structure, walker.leaves, walker.n_nodes, instances, composites, starters, across, flow_sets, name, split
    )


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
