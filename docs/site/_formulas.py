"""Equations of components as formulas (MathML), read from the source of their method `equations`."""

import ast
import dataclasses
import inspect
import re
import textwrap
from collections.abc import Iterator
from typing import Any

from acausal import Component

from ._mathml import Unreadable, formula


@dataclasses.dataclass
class _Law:
    """Equations by name, the local variables in which they are written, and calls that add further equations."""

    equations: dict[str, str] = dataclasses.field(default_factory=dict)
    definitions: dict[str, str] = dataclasses.field(default_factory=dict)
    calls: list[str] = dataclasses.field(default_factory=list)


def law(cls: type) -> Iterator[str]:
    """The equations of a component, as formulas if each is one expression, otherwise as code."""
    if not issubclass(cls, Component) or cls.equations is Component.equations:
        return
    try:
        found = _read(cls, list(cls.__mro__))
    except Unreadable:
        yield f"\n**Equations**\n\n```python\n{textwrap.dedent(inspect.getsource(cls.equations)).rstrip()}\n```"
        return
    yield f"\n**Equations**\n\n{_lines(found.equations)}\n"
    if found.definitions:
        yield f"\nwith\n\n{_lines(found.definitions)}\n"
    if found.calls:
        yield f"\nand the equations of {', '.join(f'`{call}`' for call in found.calls)}.\n"


def _lines(formulas: dict[str, str]) -> str:
    shown = "".join(f'<div><math display="inline">{one}</math></div>' for one in dict.fromkeys(formulas.values()))
    return f'<div class="law">{shown}</div>'


def _read(cls: Any, order: list[Any]) -> _Law:
    """The equations of the first class in the order that states any, with those of its bases that it adds to."""
    while "equations" not in vars(order[0]):
        order = order[1:]
    if order[0] is Component:
        return _Law()
    method = vars(order[0])["equations"]
    function = ast.parse(textwrap.dedent(inspect.getsource(method))).body[0]
    assert isinstance(function, ast.FunctionDef)
    rates, found = function.args.args[1].arg, _Law()
    for statement in function.body:
        match statement:
            case ast.Expr(value=ast.Constant()) | ast.Delete():
                continue
            case ast.Assign(targets=[target], value=value):
                text = f"{formula(target, rates)}<mo>=</mo>{formula(value, rates)}"
                found.definitions[ast.unparse(target)] = text
            case ast.Return(value=ast.expr() as value):
                _add(found, value, rates, cls, order[1:])
            case _:
                raise Unreadable
    return found


def _add(found: _Law, value: ast.expr, rates: str, cls: Any, bases: list[Any], when: str = "") -> None:
    match value:
        case ast.BinOp(left=left, op=ast.BitOr(), right=right):
            _add(found, left, rates, cls, bases, when)
            _add(found, right, rates, cls, bases, when)
        case ast.IfExp(test=test, body=body, orelse=other):
            condition = ast.unparse(test).replace("self.", "")
            _add(found, body, rates, cls, bases, f"<mtext> if {condition}</mtext>")
            _add(found, other, rates, cls, bases, f"<mtext> unless {condition}</mtext>")
        case ast.Call(func=ast.Attribute(value=ast.Call(func=ast.Name(id="super")), attr="equations")):
            base = _read(cls, bases)
            found.equations |= base.equations
            found.definitions |= base.definitions
            found.calls += base.calls
        case ast.Call(func=ast.Name(id="dict"), args=[], keywords=keywords):
            found.equations |= {str(one.arg): _equation(one.value, rates) + when for one in keywords}
        case ast.Call(func=ast.Name(id=name)) if name != "dict":
            found.calls.append(re.sub(r"\b(self\.)?_?(?=\w)", "", ast.unparse(value)))
        case ast.Dict(keys=keys, values=values):
            names = [str(key.value) for key in keys if isinstance(key, ast.Constant)]
            if len(names) < len(values):
                raise Unreadable
            stated = zip(names, values, strict=True)
            found.equations |= {name: _equation(one, rates) + when for name, one in stated}
        case _:
            raise Unreadable


def _equation(value: ast.expr, rates: str) -> str:
    match value:
        case ast.Call(func=ast.Name(id="eq"), args=[left, right]):
            return f"{formula(left, rates)}<mo>=</mo>{formula(right, rates)}"
        case ast.Call(func=ast.Name(id="eq"), args=[left]):
            return f"{formula(left, rates)}<mo>=</mo><mn>0</mn>"
        case _:
            raise Unreadable
