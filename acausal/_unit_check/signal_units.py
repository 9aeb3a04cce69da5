"""Connected signals: they have no declared unit, but the equations at both ends may determine one."""

import functools as ft
from collections.abc import Iterator

import numpy as np

from .._reduce.flat_model import FlatModel, Instances
from .._reduce.graph import connected
from .._units.dimension import Dimension, described, si_unit_of
from .._units.parsing import common_unit, parsed
from .kind_units import kind_units

# An angle has no dimension: these are the units of its derivatives in a component that has angles.
OF_ANGLES = {parsed(unit).dimension: unit for unit in ("rad/s", "rad/s2")}


def signal_problems(flat: FlatModel) -> list[str]:
    """Connections, also through blocks that pass a signal on, between ports of different quantities."""
    known = _dimensions(flat)
    problems = []
    for net in _nets(flat):
        first: dict[Dimension, int] = {}
        for node in net:
            dimension = known.get(int(flat.leaf_of_node[node]))
            if dimension is not None:
                first.setdefault(dimension, node)
        if len(first) > 1:
            problems.append(_problem(flat, first))
    return problems


def unit_of_leaf(flat: FlatModel, leaf: int) -> str:
    """The declared unit of a leaf, otherwise that of the quantity to which it is connected; "" if none is known."""
    return flat.leaves[leaf].declaration.unit or _signal_units(flat).get(leaf, "")


@ft.lru_cache(maxsize=64)
def _signal_units(flat: FlatModel) -> dict[int, str]:
    """The unit of each leaf without a declared one, by number, as far as its equations or those of the leaves to which
    it is connected determine it.
    """
    own = {leaf: unit for leaf, unit in _units(flat).items() if not flat.leaves[leaf].declaration.unit}
    found = dict(own)
    for net in _nets(flat):
        leaves = [int(flat.leaf_of_node[node]) for node in net]
        units = {own[leaf]: None for leaf in leaves if leaf in own}
        units |= {flat.leaves[leaf].declaration.unit: None for leaf in leaves if flat.leaves[leaf].declaration.unit}
        if unit := common_unit(list(units)):
            found |= dict.fromkeys((leaf for leaf in leaves if not flat.leaves[leaf].declaration.unit), unit)
    return found


def _nets(flat: FlatModel) -> list[list[int]]:
    """The nodes of equal dimension that are connected to a signal, in order."""
    unlike = np.array([not leaf.declaration.unit for leaf in flat.leaves], dtype=bool)[flat.leaf_of_node]
    pairs = flat.across[unlike[flat.across].any(axis=1)]
    edges = np.concatenate([pairs, *_passed_on(flat)]).astype(int)
    if not len(edges):
        return []
    nodes, edges = np.unique(edges, return_inverse=True)
    count, label = connected(edges.reshape(-1, 2), len(nodes))
    nets: list[list[int]] = [[] for _ in range(count)]
    for node, net in zip(nodes.tolist(), label.tolist(), strict=True):
        nets[net].append(node)
    return nets


def _problem(flat: FlatModel, found: dict[Dimension, int]) -> str:
    names = [f"{flat.node_name(node)} is in {described(dimension)}" for dimension, node in found.items()]
    return f"These signals are connected, but carry different quantities: {', '.join(names)}."


def _dimensions(flat: FlatModel) -> dict[int, Dimension]:
    """The known dimension of each leaf of a component with equations."""
    return {
        instances.leaf(entry, slot): dimension
        for instances in flat.instances
        for slot, dimension in enumerate(kind_units(instances.kind).dimensions)
        if dimension is not None
        for entry in range(len(instances.paths))
    }


def _units(flat: FlatModel) -> dict[int, str]:
    """The unit of each leaf of known dimension: that of a declared variable of its component, if there is one."""
    found = {}
    for instances in flat.instances:
        kind = instances.kind
        declared = {parsed(one.unit).dimension: one.unit for one in kind.declarations if one.unit}
        if "rad" in declared.values():
            declared = OF_ANGLES | declared
        for slot, dimension in enumerate(kind_units(kind).dimensions):
            if dimension is not None:
                unit = declared.get(dimension, si_unit_of(dimension))
                found |= dict.fromkeys((instances.leaf(entry, slot) for entry in range(len(instances.paths))), unit)
    return found


def _passed_on(flat: FlatModel) -> Iterator[np.ndarray]:
    """Pairs of nodes of equal dimension by the equations of a component."""
    for instances in flat.instances:
        alike = kind_units(instances.kind).alike
        if alike:
            yield from _node_pairs(flat, instances, alike)


def _node_pairs(flat: FlatModel, instances: Instances, alike: frozenset[tuple[int, int]]) -> Iterator[np.ndarray]:
    nodes = flat.nodes(instances)
    for a, b in sorted(alike):
        pairs = nodes[:, [a, b]]
        yield pairs[(pairs >= 0).all(axis=1)]
