"""Equations of loops, from their templates.

For a loop over derivatives, the front end writes two equations and a template. The right sides of the other equations
are zero, so each equation is built from the template.
"""

import itertools
from collections.abc import Iterator
from typing import Any

from .._errors import ModelicaError

_Tree = dict[str, Any]
_PARTS = {"structured_equations": "equations", "initial_structured_equations": "initial_equations"}
_OPERATIONS = {"Add": int.__add__, "Sub": int.__sub__, "Mul": int.__mul__}
_PLACES = ("span", "component_ref", "generated", "instance_id", "resolved_function")


def expanded(content: _Tree) -> _Tree:
    """A flat model with all equations of its loops. Raises `ModelicaError` if a loop does not match its template."""
    found = dict(content)
    for part, equations in _PARTS.items():
        written = list(content[equations])
        for family in content[part]:
            if not family["interiors_materialized"]:
                for place, residual in _residuals(family):
                    written[place] = written[place] | {"residual": _matching(residual, written[place]["residual"])}
        found[equations] = written
    return found


def _residuals(family: _Tree) -> Iterator[tuple[int, Any]]:
    """The places and residuals of the equations of a loop: the last index changes fastest."""
    binders, body = family["domain"]["binders"], family["template"]["body"]
    if family["equations_per_point"] != 1 or len(body) != 1:
        raise ModelicaError(
            "The front end wrote a loop with several equations for each index, which is not supported. Remedy: write a "
            "loop for each of the equations."
        )
    ranges = [range(b["lower"], b["upper"] + (1 if b["step"] > 0 else -1), b["step"]) for b in binders]
    names = [b["display_name"] for b in binders]
    for number, point in enumerate(itertools.product(*ranges)):
        yield family["first_equation_index"] + number, _at(body[0], dict(zip(names, point, strict=True)))


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


def _matching(residual: _Tree, written: _Tree) -> _Tree:
    """A residual whose left side must be that of the equation that the front end wrote."""
    if _plain(residual["Binary"]["lhs"]) != _plain(written["Binary"]["lhs"]):
        raise ModelicaError("The front end wrote a loop whose equations do not match their template.")
    return residual


def _plain(node: Any) -> Any:
    if isinstance(node, list):
        return [_plain(item) for item in node]
    if isinstance(node, dict):
        return {key: _plain(value) for key, value in node.items() if key not in _PLACES}
    return node
