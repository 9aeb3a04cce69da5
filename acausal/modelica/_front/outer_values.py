"""Parameters that select equations and follow an outer component.

rumoca selects the branch of an `if` whose branches have different numbers of equations, and the range of a loop, from
the values that the class of an outer component declares: it ignores the modifiers of the inner component. So parameters
that follow such a modifier get their value by a modifier of their own.
"""

import dataclasses
import json
import re
from collections.abc import Iterator
from typing import Any

from .._errors import ModelicaError

_Tree = dict[str, Any]
_SIZES = "ArrayDimension"  # selections that rumoca makes with the modified values

_ELEMENTS = (
    "{} selects equations and follows an outer component, but not all elements of its array have the same value. "
    "Remedy: declare them as separate components."
)


def followers(content: dict[str, Any]) -> dict[str, str]:
    """The parameters of a flat model that select equations and follow an outer component, with their values as text.

    Raises `ModelicaError` for one that no modifier can give, or whose value is an expression.
    """
    variables, finals, found = content["variables"], content["variable_final_flags"], {}
    selections = [choice for choice in content.get("parameter_branch_selections", ()) if choice["kind"] != _SIZES]
    for full, *shorter in (names for choice in selections for names in choice["references"]):
        name = next((name for name in (full, *shorter) if name in variables), None)
        if name is None:
            continue
        for follower, value in _followed(variables, _Reference(name, is_outside=name != full)):
            if follower is None or value is None or finals.get(follower):
                remedy = "in the class that uses it, declare a parameter that equals the outer one and use that instead"
                if finals.get(follower):
                    remedy = f"declare {follower} without final"
                raise ModelicaError(
                    f"{full} selects equations and gets its value from a modifier of an inner component, which the "
                    f"front end ignores. Remedy: {remedy}."
                )
            found[follower] = value
    _check_arrays(variables, found)
    return found


@dataclasses.dataclass(frozen=True)
class _Reference:
    """A reference to a parameter, or to a literal of an enumeration, by name.

    `follower` is the parameter on the way here whose binding refers to an outer component. `is_outside` tells whether
    the reference is to a parameter of an inner component, and `is_modified` whether one of its modifiers has led here.
    """

    name: str
    follower: str | None = None
    is_outside: bool = False
    is_modified: bool = False


def _followed(variables: _Tree, at: _Reference) -> Iterator[tuple[str | None, str | None]]:
    """Follows a reference to the values that come from modifiers of inner components.

    Yields the parameter that follows the outer component, None for a direct reference; and the value as text, None for
    an expression.
    """
    variable = variables.get(at.name)
    if variable is None:
        if at.is_modified:
            yield at.follower, at.name
        return
    is_modified = at.is_modified or (at.is_outside and variable["binding_from_modification"])
    at = dataclasses.replace(at, is_modified=is_modified)
    match variable["binding"]:
        case {"VarRef": reference} if not reference["subscripts"]:
            yield from _followed(variables, _next(at, reference))
        case {"Literal": {"value": value}}:
            if is_modified:
                yield at.follower, json.dumps(next(iter(value.values())))
        case expression:
            for reference in _references(expression):
                after = _next(at, reference)
                for follower, value in _followed(variables, after):
                    yield follower, None if after.is_outside else value


def _next(at: _Reference, reference: _Tree) -> _Reference:
    """The reference in the binding of a parameter."""
    after = dataclasses.replace(at, name=reference["name"]["name"])
    if at.is_outside or reference["name"]["component_ref"] is not None:
        return after
    return dataclasses.replace(after, follower=at.name, is_outside=True)


def _references(node: Any) -> Iterator[_Tree]:
    """The references in an expression."""
    if isinstance(node, dict) and "VarRef" in node:
        yield node["VarRef"]
    for inner in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
        yield from _references(inner)


def _check_arrays(variables: _Tree, found: dict[str, str]) -> None:
    """Raises `ModelicaError` if only some elements of an array of components follow an outer component."""
    arrays = {_without_indices(path) for path in found if "[" in path}
    for name in variables:
        if "[" in name and name not in found and _without_indices(name) in arrays:
            raise ModelicaError(_ELEMENTS.format(name))


def _without_indices(path: str) -> str:
    return re.sub(r"\[[^\]]*\]", "", path)


def modifiers(values: dict[str, str]) -> str:
    """A modifier that gives these values: `(tank(d = 2), cell(each d = true))`. An array of components gets one value.

    Raises `ModelicaError` if the elements of an array differ.
    """
    tree: _Tree = {}
    for path, value in values.items():
        *steps, last = path.split(".")
        branch, each = tree, ""
        for step in steps:
            branch = branch.setdefault(each + step.partition("[")[0], {})
            each = "each " if "[" in step else ""
        if branch.setdefault(each + last, value) != value:
            raise ModelicaError(_ELEMENTS.format(path))
    return f"({_written(tree)})"


def _written(tree: _Tree) -> str:
    return ", ".join(
        f"{name}({_written(inner)})" if isinstance(inner, dict) else f"{name} = {inner}" for name, inner in tree.items()
    )
