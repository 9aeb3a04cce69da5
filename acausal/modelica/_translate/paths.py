"""Modelica paths, and trees of what lies at them."""

import dataclasses
import re
from collections.abc import Callable, Iterable
from typing import Generic, TypeVar

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

    def find(self, parts: list[tuple[str, Index]]) -> "PathTree[T] | list | None":
        """The branch of a path. A list of branches, if the path leaves out the index of an array."""
        if not parts:
            return self
        (name, index), *rest = parts
        part = self.parts.get(name)
        if part is None:
            return None
        if index:
            member = part.members.get(index)
            return None if member is None else member.find(rest)
        if part.members and rest:
            found = [member.find(rest) for member in part.members.values()]
            return None if any(item is None for item in found) else found
        return part.find(rest)


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
