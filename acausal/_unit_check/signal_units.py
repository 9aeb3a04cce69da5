"""Connected signals: they have no declared unit, but the equations at both ends may determine one."""

from collections.abc import Iterator

import numpy as np

from .._reduce.flat_model import FlatModel, Instances
from .._reduce.graph import connected
from .._units.dimension import Dimension, described
from .kind_units import kind_units


def signal_problems(flat: FlatModel) -> list[str]:
    """Connections, also through blocks that pass a signal on, between ports of different quantities."""
    known = _dimensions(flat)
    unlike = np.array([not leaf.declaration.unit for leaf in flat.leaves], dtype=bool)[flat.leaf_of_node]
    pairs = flat.across[unlike[flat.across].any(axis=1)]
    edges = np.concatenate([pairs, *_passed_on(flat)]).astype(int)
    if not len(edges):
        return []
    nodes, edges = np.unique(edges, return_inverse=True)
    count, label = connected(edges.reshape(-1, 2), len(nodes))
    first: list[dict[Dimension, int]] = [{} for _ in range(count)]
    for node, net in zip(nodes.tolist(), label.tolist(), strict=True):
        dimension = known.get(int(flat.leaf_of_node[node]))
        if dimension is not None:
            first[net].setdefault(dimension, node)
    return [_problem(flat, found) for found in first if len(found) > 1]


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
