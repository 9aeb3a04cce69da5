"""The tree of components of a translated model."""

import dataclasses
import keyword
from collections.abc import Iterable, Mapping
from typing import Any, TypeAlias

from ..._declare.annotations import Declaration
from ..._declare.component import Component
from ..._declare.fields import FromOne, join
from ..._declare.node import Port
from .forms import declaration_of
from .leaves import ModelLeaf
from .model import ModelicaModel
from .nodes import instance, node_class
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
    return f"{text}_" if keyword.iskeyword(text) or hasattr(ModelicaModel, text) or text == "flat" else text


def tree(
    leaves: Iterable[ModelLeaf],
    ports: Mapping[str, type[Port]],
    base: type,
    name: str,
    namespace: dict[str, Any],
    names: Mapping[str, str],
) -> Any:
    """The root component of the leaves. `ports` are the classes of ports by Modelica path, and `names` those of the
    classes of parts in the text, by path without indices.
    """
    return _Tree(ports, names).node(tree_of(leaves, lambda leaf: leaf.path), "", base, name, namespace)


def attribute_path(path: str) -> str:
    """The path of a leaf in the tree of components, with the names of attributes."""
    pieces = []
    for part, index in split(path):
        pieces.append(attribute(part) + "".join(f"[{i}]" for i in index))
    return ".".join(pieces)


def _declaration(leaf: ModelLeaf) -> Declaration:
    """The declaration of a leaf. A given start value is that of `fixed=true` or of an initial equation."""
    is_fixed = leaf.role == "var" and (leaf.is_followed or leaf.value is not None)
    return dataclasses.replace(declaration_of(leaf), is_fixed=is_fixed, limits=leaf.limits)


@dataclasses.dataclass(frozen=True)
class _Tree:
    """`classes` are those of the parts, of which equal ones share one."""

    ports: Mapping[str, type[Port]]
    names: Mapping[str, str]
    classes: dict[Any, type] = dataclasses.field(default_factory=dict)

    def node(self, branch: _Branch, path: str, base: type, name: str, namespace: dict[str, Any]) -> Any:
        declared = {attribute(n): inner.item for n, inner in branch.parts.items() if inner.item is not None}
        parts = {
            attribute(n): self._part(inner, join(path, n), n) for n, inner in branch.parts.items() if inner.item is None
        }
        values = {n: None if leaf.is_followed else leaf.value for n, leaf in declared.items()}
        if path in self.ports:
            return instance(self.ports[path], values)
        leaves = {n: _declaration(leaf) for n, leaf in declared.items()}
        key = (base, name, tuple(leaves.items()), tuple(parts))
        if key not in self.classes:
            self.classes[key] = node_class(base, name, leaves, {**namespace, "parts": dict.fromkeys(parts)})
        return instance(self.classes[key], {**values, **parts})

    def _part(self, branch: _Branch, path: str, name: str) -> Any:
        if branch.members:
            return self._members(list(branch.members.items()), path, name, ())
        own = self.names.get(".".join(part for part, _ in split(path)))
        return self.node(branch, path, ModelicaPart, attribute(own or name), {})

    def _members(self, items: list[tuple[Index, _Branch]], path: str, name: str, before: Index) -> FromOne:
        """The members of an array of components; of several dimensions, nested. `before` are the outer indices."""
        rows: dict[int, list[tuple[Index, _Branch]]] = {}
        for index, inner in items:
            rows.setdefault(index[0], []).append((index[1:], inner))
        return FromOne(self._row(row, path, name, (*before, first)) for first, row in sorted(rows.items()))

    def _row(self, row: list[tuple[Index, _Branch]], path: str, name: str, index: Index) -> Any:
        if row[0][0]:
            return self._members(row, path, name, index)
        return self._part(row[0][1], f"{path}[{','.join(map(str, index))}]", name)
