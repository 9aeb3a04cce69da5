"""Composites with an energy account, but no equations, which are not instances of the flat model."""

from collections.abc import Iterator
from typing import Any

import jax

from .._declare.array import Array
from .._declare.component import Component
from .._reduce.connections import children
from .._reduce.flat_model import FlatModel, Kind


def accounting_composites(flat: FlatModel) -> Iterator[tuple[str, Kind]]:
    """The path of each such composite, and its kind; those of an array of components once."""
    view = flat.structure.unflatten(range(flat.structure.num_leaves))
    yield from _below(flat, view, "", 0)


def _below(flat: FlatModel, node: Any, path: str, depth: int) -> Iterator[tuple[str, Kind]]:
    if not isinstance(node, Component):
        return
    cls = type(node)
    if cls.energy is not Component.energy and cls.equations is Component.equations:
        yield path, _kind(flat, node, path, depth)
    for part_path, part in children(node, path):
        yield from _below(flat, part, part_path, depth + isinstance(node, Array))


def _kind(flat: FlatModel, node: Component, path: str, depth: int) -> Kind:
    own = [flat.leaves[index] for index in jax.tree_util.tree_leaves(node)]
    return Kind(
        jax.tree_util.tree_structure(node),
        tuple(leaf.stack[depth:] + leaf.sizes for leaf in own),
        type(node),
        tuple(leaf.declaration for leaf in own),
        tuple(leaf.path.removeprefix(f"{path}.") for leaf in own),
        depth if any(len(leaf.stack) > depth for leaf in own) else 0,
    )
