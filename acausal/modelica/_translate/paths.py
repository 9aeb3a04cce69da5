"""Modelica paths, and the tree of the variables of a flat model."""

import dataclasses
import re
from collections.abc import Iterable

from .._syntax.flat import FlatVariable

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
class VariableTree:
    """A variable, the parts of a component or record by name, or the members of an array of components by index."""

    variable: FlatVariable | None = None
    parts: "dict[str, VariableTree]" = dataclasses.field(default_factory=dict)
    members: "dict[Index, VariableTree]" = dataclasses.field(default_factory=dict)

    def find(self, parts: list[tuple[str, Index]]) -> "VariableTree | list | None":
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


def tree_of(variables: Iterable[FlatVariable]) -> VariableTree:
    """The variables of a flat model as a tree."""
    root = VariableTree()
    for variable in variables:
        here = root
        for name, index in split(variable.name):
            here = here.parts.setdefault(name, VariableTree())
            if index:
                here = here.members.setdefault(index, VariableTree())
        here.variable = variable
    return root
