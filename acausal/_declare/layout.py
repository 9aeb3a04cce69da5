"""Trees of nodes with other leaves, and the layout of given and missing start values."""

import dataclasses
import functools as ft
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, TypeVar

import jax
from jax.tree_util import PyTreeDef

from .._numbers import Numbers
from .annotations import Declaration
from .fields import copied, dynamic_fields, first_index, join, parts_of
from .node import Node, check_is_node, leaves_of, nodes_of

N = TypeVar("N", bound=Node)
T = TypeVar("T")


def rebuilt(node: T, new: Callable[[str, Declaration, Any], object], path: str = "", *, is_new: bool = False) -> T:
    """A copy of a tree with `new(path, declaration, value)` for each leaf. `is_new` removes its event history."""
    if isinstance(node, tuple | list):
        indexed = enumerate(node, start=first_index(node))
        return type(node)(rebuilt(item, new, f"{path}[{index}]", is_new=is_new) for index, item in indexed)
    if not isinstance(node, Node):
        return node
    changes: dict[str, object] = {"_past": None} if is_new and "_past" in vars(node) else {}
    for name, declaration in dynamic_fields(type(node)):
        value, here = getattr(node, name), join(path, name)
        is_part = declaration is None
        changes[name] = rebuilt(value, new, here, is_new=is_new) if is_part else new(here, declaration, value)
    return copied(node, changes)


def with_leaves(node: T, leaves: Iterable[Numbers | None]) -> T:
    """A tree of nodes with other leaves, in pytree order; None for values that are not given."""
    remaining = iter(leaves)
    return rebuilt(node, lambda path, declaration, value: next(remaining))


def as_new(node: T) -> T:
    """A tree of nodes without its event history."""
    return rebuilt(node, lambda path, declaration, value: value, is_new=True)


def complete(node: N) -> N:
    """A tree of nodes without event history, with zeros for missing start values."""
    leaves, layout = complete_leaves(node)
    return layout.structure.unflatten([0.0 if leaf is None else leaf for leaf in leaves])


@dataclasses.dataclass(frozen=True, eq=False)
class Layout:
    """The leaves of a model in pytree order, including those that are not given.

    `structure` is that of the complete model. `places[i]` is the index of leaf i among the given ones, -1 if it is not
    given. `determined` lists functions of ranges of leaves that replace those which others determine;
    `determined_names` are the paths of the parameters among them.
    """

    structure: PyTreeDef
    places: tuple[int, ...]
    determined: tuple[tuple[int, int, Callable[[Sequence[Any]], Sequence[Any]]], ...]
    determined_names: frozenset[str]

    def spread(self, given: Sequence[T]) -> list[T | None]:
        """All leaves; None for those that are not given."""
        return [None if place < 0 else given[place] for place in self.places]

    def numbers(self, given: Sequence[Any]) -> list[Any]:
        """The numbers of all leaves, including those that others determine; None for those that are not given."""
        leaves = self.spread(given)
        for first, last, function in self.determined:
            leaves[first:last] = function(leaves[first:last])
        return leaves


def complete_leaves(model: Node) -> tuple[list[Any], Layout]:
    """All leaves of a model, with None for missing start values, and their layout."""
    check_is_node(model)
    given, structure = jax.tree_util.tree_flatten(model)
    layout = layout_of(structure)
    # Shapes stand for numbers while the structure of a model is analysed; they determine nothing.
    if layout.determined and any(isinstance(leaf, jax.ShapeDtypeStruct) for leaf in given):
        return layout.spread(given), layout
    return layout.numbers(given), layout


def with_determined(model: N) -> N:
    """A model whose parameters that others determine have their present values. Start values stay as they are given."""
    given, structure = jax.tree_util.tree_flatten(model)
    layout = layout_of(structure)
    if not layout.determined:
        return model
    numbers = zip(layout.spread(given), layout.numbers(given), strict=True)
    return with_leaves(model, [None if old is None else new for old, new in numbers])


@ft.lru_cache(maxsize=4096)
def layout_of(structure: PyTreeDef) -> Layout:
    """The layout of the leaves of models with this tree structure."""
    numbered = structure.unflatten(range(structure.num_leaves))
    places = tuple(-1 if leaf.value is None else leaf.value for leaf in leaves_of(numbered))
    whole = rebuilt(numbered, lambda path, declaration, value: 0.0 if value is None else value, is_new=True)
    nodes = ((path, getattr(node, "determined_names", ())) for path, node in nodes_of(numbered))
    names = frozenset(join(path, name) for path, own in nodes for name in own)
    return Layout(jax.tree_util.tree_structure(whole), places, tuple(_determined(numbered, 0)), names)


def determined_names(model: Node) -> frozenset[str]:
    """The paths of the parameters that others determine."""
    return layout_of(jax.tree_util.tree_structure(model)).determined_names


def _determined(node: Node, first: int) -> Iterator[tuple[int, int, Callable[[Sequence[Any]], Sequence[Any]]]]:
    """The functions that determine leaves of a node and of its parts, whose leaves count from `first`."""
    start = first
    for name, declaration in dynamic_fields(type(node)):
        if declaration is not None:
            first += 1
            continue
        for _, part in parts_of(getattr(node, name)):
            yield from _determined(part, first)
            first += len(list(leaves_of(part)))
    if (function := getattr(type(node), "determined", None)) is not None:
        yield start, first, function
