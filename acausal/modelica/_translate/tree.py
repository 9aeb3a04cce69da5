"""The tree of components of a translated model."""

import keyword
from collections.abc import Iterable
from typing import Any, TypeAlias

from ..._declare.component import Component
from ..._declare.fields import FromOne
from .forms import declaration_of, instance, node_class
from .leaves import ModelLeaf
from .paths import Index, PathTree, split, tree_of


class ModelicaPart(Component, partial=True):
    """A component or record of a Modelica model."""


_Branch: TypeAlias = PathTree[ModelLeaf]


def attribute(name: str) -> str:
    """The name of an attribute for a Modelica name: an underscore follows where Python or a component uses the name."""
    text = name.strip("'")
    if not text.isidentifier():
        text = "".join(c if c.isidentifier() or c.isdigit() else "_" for c in text)
        text = text if text.isidentifier() else f"_{text}"
    return f"{text}_" if keyword.iskeyword(text) or hasattr(Component, text) else text


def tree(leaves: Iterable[ModelLeaf], base: type, name: str, namespace: dict[str, Any]) -> Any:
    """The root component of the leaves."""
    return _node(tree_of(leaves, lambda leaf: leaf.path), base, name, namespace)


def attribute_path(path: str) -> str:
    """The path of a leaf in the tree of components, with the names of attributes."""
    pieces = []
    for part, index in split(path):
        pieces.append(attribute(part) + "".join(f"[{i}]" for i in index))
    return ".".join(pieces)


def _node(branch: _Branch, base: type, name: str, namespace: dict[str, Any]) -> Any:
    declared = {attribute(n): inner.item for n, inner in branch.parts.items() if inner.item is not None}
    parts = {attribute(n): _part(inner, n) for n, inner in branch.parts.items() if inner.item is None}
    leaves = {n: declaration_of(leaf) for n, leaf in declared.items()}
    cls = node_class(base, name, leaves, {**namespace, "parts": dict.fromkeys(parts)})
    values = {n: None if leaf.is_followed else leaf.value for n, leaf in declared.items()}
    return instance(cls, {**values, **parts})


def _part(branch: _Branch, name: str) -> Any:
    if branch.members:
        return _members(list(branch.members.items()), name)
    return _node(branch, ModelicaPart, f"Part_{attribute(name)}", {})


def _members(items: list[tuple[Index, _Branch]], name: str) -> FromOne:
    """The members of an array of components; of several dimensions, nested."""
    if len(items[0][0]) == 1:
        return FromOne(_part(inner, name) for _, inner in sorted(items, key=lambda item: item[0]))
    rows: dict[int, list[tuple[Index, _Branch]]] = {}
    for index, inner in items:
        rows.setdefault(index[0], []).append((index[1:], inner))
    return FromOne(_members(row, name) for _, row in sorted(rows.items()))
