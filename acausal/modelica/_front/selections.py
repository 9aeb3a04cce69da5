"""Parameters that select equations, components and sizes when a model is loaded."""

from collections.abc import Iterator
from typing import Any

from .marks import marks
from .outer_marks import outer_components

_Tree = dict[str, Any]


def selecting(content: _Tree) -> dict[str, list[Any]]:
    """The names of parameters that select equations, sizes of arrays of numbers and ranges, and the conditions and
    sizes of components. Parameters of outer components are those of the inner ones.
    """
    variables, inner = content["variables"], dict(outer_components(content))
    names = [
        _of_inner(full, inner)
        for choice in content.get("parameter_branch_selections", ())
        for full, *_ in choice["references"]
    ]
    known = [name for name in dict.fromkeys(names) if name in variables]
    return {"names": known, "expressions": [variable["binding"] for *_, variable in marks(content, "if", "size")]}


def _of_inner(name: str, inner: dict[str, str]) -> str:
    outer = next((one for one in inner if name.startswith(f"{one}.")), None)
    return name if outer is None else inner[outer] + name.removeprefix(outer)


def deciding(content: _Tree) -> set[str]:
    """The parameters that select, and those that their values depend on."""
    variables, found = content["variables"], set()
    selections = selecting(content)
    todo = [*selections["names"], *references(selections["expressions"])]
    while todo:
        name = todo.pop()
        if name in variables and name not in found:
            found.add(name)
            todo += references(variables[name]["binding"])
    return found


def references(node: Any) -> Iterator[str]:
    """The names of the variables in an expression."""
    if isinstance(node, dict) and "VarRef" in node:
        yield node["VarRef"]["name"]["name"]
    for inner in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
        yield from references(inner)
