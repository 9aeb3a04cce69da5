"""The energy account of a component class, from the source of its method `energy`."""

import ast
import inspect
import textwrap
from collections.abc import Iterator
from typing import Any

from .component import Component, Energy

_UNITS = dict(stored="J", dissipated="W", supplied="W")


def energy_terms(cls: Any) -> Iterator[tuple[str, str, str, str, str]]:
    """The terms of the account: name, unit, two empty columns, and the expression if it can be read by itself."""
    if not issubclass(cls, Component) or cls._partial:
        return
    if cls.energy is Component.energy:
        is_composite = cls.connections is not Component.connections
        yield "that of its parts" if is_composite else "none is stored, dissipated or supplied", "", "", "", ""
        return
    terms = _stated(cls.energy)
    if not terms:
        yield "see the method `energy`", "", "", "", ""
    for name in Energy._fields:
        if name in terms:
            yield name, _UNITS[name], "", "", terms[name]


def _stated(method: Any) -> dict[str, str]:
    """The arguments of `Energy(...)` in the source of a method; none if another function or a choice computes them."""
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(method)))
    except (OSError, TypeError, SyntaxError):
        return {}
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call) and ast.unparse(node.func) == "Energy"]
    terms = calls[0].keywords if len(calls) == 1 else []
    return {term.arg: _expression(term.value) for term in terms if term.arg}


def _expression(value: ast.expr) -> str:
    """An expression of public attributes; empty if it refers to anything else, such as a local variable."""
    names = {node.id for node in ast.walk(value) if isinstance(node, ast.Name)}
    attributes = {node.attr for node in ast.walk(value) if isinstance(node, ast.Attribute)}
    is_readable = names <= {"self", "jnp"} and not any(name.startswith("_") for name in attributes)
    return ast.unparse(value).replace("self.", "").replace("jnp.", "") if is_readable else ""
