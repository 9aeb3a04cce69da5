"""Modelica paths, and trees of what lies at them."""

import dataclasses
import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Generic, TypeVar

T = TypeVar("T")

_PART = re.compile(r"(?P<name>'(?:[^'\\]|\\.)*'|[^.\[\]]+)(?:\[(?P<index>[^\]]*)\])?(?:\.|$)")
Index = tuple[int, ...]


def split(path: str) -> list[tuple[str, Index]]:
    """The parts of a path with their indices: `a.b[2].c` is a, b with (2,), and c."""
    found = []
    for match in _PART.finditer(path):
        index = match["index"]
        found.append((match["name"], tuple(int(i) for i in index.split(",")) if index else ()))
    return found


@dataclasses.dataclass
class PathTree(Generic[T]):
    """An item, the parts of a component or record by name, or the members of an array of components by index."""

    item: T | None = None
    parts: "dict[str, PathTree[T]]" = dataclasses.field(default_factory=dict)
    members: "dict[Index, PathTree[T]]" = dataclasses.field(default_factory=dict)

    def find(self, parts: list[tuple[str, Index]]) -> "PathTree[T] | None":
        """The branch of a path."""
        found: PathTree[T] | None = self
        for name, index in parts:
            found = found.parts.get(name)
            if found is not None and index:
                found = found.members.get(index)
            if found is None:
                return None
        return found


def nested(members: Mapping[Index, Any], join: Callable[[list[Any]], Any]) -> Any:
    """The array of members by index: those of each axis are joined."""
    if all(len(index) == 1 for index in members):
        return join(list(members.values()))
    rows: dict[int, dict[Index, Any]] = {}
    for (first, *rest), member in members.items():
        rows.setdefault(first, {})[tuple(rest)] = member
    return join([nested(row, join) for row in rows.values()])


def tree_of(items: Iterable[T], path: Callable[[T], str]) -> PathTree[T]:
    """Items by their paths."""
    root: PathTree[T] = PathTree()
    for item in items:
        here = root
        for name, index in split(path(item)):
            here = here.parts.setdefault(name, PathTree())
            if index:
                here = here.members.setdefault(index, PathTree())
        here.item = item
    return root
