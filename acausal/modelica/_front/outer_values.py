"""Parameters that select equations and follow an outer component.

rumoca selects the branch of an `if` whose branches have different numbers of equations, and the range of a loop, from
the values that the class of an outer component declares: it ignores the modifiers of the inner component. So parameters
that follow such a modifier get their value by a modifier of their own.
"""

import json
from typing import Any

from .._errors import ModelicaError

_Tree = dict[str, Any]
_SIZES = "ArrayDimension"  # selections that rumoca makes with the modified values


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
        follower, value, is_modified = _followed(variables, name, is_outside=name != full)
        if not is_modified:
            continue
        if follower is None or value is None or finals.get(follower):
            remedy = f"in the class that uses it, declare a parameter p = {name} and use p in the condition"
            if finals.get(follower):
                remedy = f"declare {follower} without final"
            raise ModelicaError(
                f"{full} selects equations and gets its value from a modifier of an inner component, which the front "
                f"end ignores. Remedy: {remedy}."
            )
        found[follower] = value
    return found


def _followed(variables: _Tree, name: str, *, is_outside: bool) -> tuple[str | None, str | None, bool]:
    """Follows the bindings of a parameter to its value.

    Returns the parameter whose binding refers to an outer component; the value as text, None for an expression; and
    whether the value comes from a modifier of the inner component. `is_outside` tells whether the parameter itself
    belongs to an inner component.
    """
    follower, is_modified = None, False
    while name in variables:
        variable = variables[name]
        is_modified |= is_outside and variable["binding_from_modification"]
        match variable["binding"]:
            case {"VarRef": {"name": {"name": str(after), "component_ref": reference}, "subscripts": []}}:
                if reference is None and not is_outside:  # an outer component
                    follower, is_outside = name, True
                name = after
            case {"Literal": {"value": value}}:
                return follower, json.dumps(next(iter(value.values()))), is_modified
            case _:
                return follower, None, is_modified
    return follower, name, is_modified


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
            raise ModelicaError(
                f"The value of {path} selects equations and follows an outer component, but differs from that of other "
                "elements of its array. Remedy: declare the elements as separate components."
            )
    return f"({_written(tree)})"


def _written(tree: _Tree) -> str:
    return ", ".join(
        f"{name}({_written(inner)})" if isinstance(inner, dict) else f"{name} = {inner}" for name, inner in tree.items()
    )
