"""Equations of loops, from their templates.

For a loop over derivatives, the front end writes two equations and a template. The right sides of the other equations
are zero, so each equation is built from the template.

The template has the values that classes declare in place of parameters of outer components. It is used only if it
agrees with the two equations.
"""

import itertools
from collections.abc import Iterator
from typing import Any

from .._errors import ModelicaError

_Tree = dict[str, Any]
_PARTS = {"structured_equations": "equations", "initial_structured_equations": "initial_equations"}
_OPERATIONS = {"Add": int.__add__, "Sub": int.__sub__, "Mul": int.__mul__}
_WRITTEN = 2  # equations of a loop that have their right sides
_PLACES = ("span", "component_ref", "generated", "instance_id", "resolved_function")


class TemplateError(ModelicaError):
    """A loop that does not match its template."""


def expanded(content: _Tree) -> _Tree:
    """A flat model with all equations of its loops. Raises `TemplateError` if a loop does not match its template."""
    found = dict(content)
    for part, equations in _PARTS.items():
        written = list(content[equations])
        for family in content[part]:
            if not family["interiors_materialized"]:
                for number, residual in enumerate(_residuals(family)):
                    place = family["first_equation_index"] + number
                    _check(residual, written[place]["residual"], is_whole=number < _WRITTEN)
                    written[place] = written[place] | {"residual": residual}
        found[equations] = written
    return found


def _residuals(family: _Tree) -> Iterator[Any]:
    """The residuals of the equations of a loop: the last index changes fastest."""
    binders, body = family["domain"]["binders"], family["template"]["body"]
    if family["equations_per_point"] != 1 or len(body) != 1:
        raise TemplateError(
            "The front end wrote a loop with several equations for each index, which is not supported. Remedy: write a "
            "loop for each of the equations."
        )
    ranges = [range(b["lower"], b["upper"] + (1 if b["step"] > 0 else -1), b["step"]) for b in binders]
    names = [b["display_name"] for b in binders]
    for point in itertools.product(*ranges):
        yield _at(body[0], dict(zip(names, point, strict=True)))


def _at(node: Any, point: dict[str, int]) -> Any:
    """An expression with numbers for the indices of a loop."""
    if isinstance(node, list):
        return [_at(item, point) for item in node]
    if not isinstance(node, dict):
        return node
    if "VarRef" in node and not node["VarRef"]["subscripts"] and node["VarRef"]["name"]["name"] in point:
        return _number(point[node["VarRef"]["name"]["name"]], node["VarRef"]["span"])
    found = {key: _at(value, point) for key, value in node.items()}
    if (value := _constant(found.get("Expr", {}).get("expr"))) is not None:
        return {"Index": {"value": value, "span": found["Expr"]["span"]}}
    return found


def _number(value: int, span: Any) -> _Tree:
    return {"Literal": {"value": {"Integer": value}, "span": span}}


def _constant(node: Any) -> int | None:
    """The value of an expression of whole numbers; None for any other."""
    if not isinstance(node, dict):
        return None
    if "Literal" in node:
        return node["Literal"]["value"].get("Integer")
    if "Binary" in node and node["Binary"]["op"] in _OPERATIONS:
        left, right = (_constant(node["Binary"][side]) for side in ("lhs", "rhs"))
        return None if left is None or right is None else _OPERATIONS[node["Binary"]["op"]](left, right)
    return None


def _check(residual: _Tree, written: _Tree, *, is_whole: bool) -> None:
    """Raises `TemplateError` if a residual, or its left side, is not that of the equation that the front end wrote."""
    sides = (residual, written) if is_whole else (residual["Binary"]["lhs"], written["Binary"]["lhs"])
    if _plain(sides[0]) != _plain(sides[1]):
        raise TemplateError("The front end wrote a loop whose equations do not match their template.")


def _plain(node: Any) -> Any:
    if isinstance(node, list):
        return [_plain(item) for item in node]
    if isinstance(node, dict):
        return {key: _plain(value) for key, value in node.items() if key not in _PLACES}
    return node
