"""Equations of components as formulas (MathML), read from the source of their method `equations`."""

import ast
import dataclasses
import html
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
        found = _read(list(cls.__mro__))
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


def _read(order: list[Any]) -> _Law:
    """The equations of the first class in the order that states any, with those of its bases that it adds to."""
    while "equations" not in vars(order[0]):
        order = order[1:]
    if order[0] is Component:
        return _Law()
    function = ast.parse(textwrap.dedent(inspect.getsource(vars(order[0])["equations"]))).body[0]
    assert isinstance(function, ast.FunctionDef)
    reader = _Reader(function.args.args[1].arg, order[1:])
    reader.statements(function.body, "")
    return reader.law


class _Reader:
    """Reads a method `equations`; `groups` are local variables that hold equations."""

    def __init__(self, rates: str, bases: list[Any]) -> None:
        self.rates, self.bases, self.law = rates, bases, _Law()
        self.groups: dict[str, ast.expr] = {}

    def statements(self, body: list[ast.stmt], when: str) -> None:
        for index, statement in enumerate(body):
            match statement:
                case ast.Expr(value=ast.Constant()) | ast.Delete():
                    continue
                case ast.Assign(targets=[ast.Name(id=name)], value=ast.Dict() | ast.IfExp() | ast.Call() as value) if (
                    _holds_equations(value)
                ):
                    self.groups[name] = value
                case ast.Assign(targets=[target], value=value):
                    self.law.definitions[ast.unparse(target)] = self.equality(target, value) + when
                case ast.If(test=test, body=[*_, ast.Return()] as first, orelse=[]):
                    self.statements(first, _condition(test, holds=True))
                    self.statements(body[index + 1 :], _condition(test, holds=False))
                    return
                case ast.Return(value=ast.expr() as value):
                    self.add(value, when)
                case _:
                    raise Unreadable

    def add(self, value: ast.expr, when: str) -> None:
        """Adds the equations of a dictionary; `when` is the condition for them."""
        match value:
            case ast.BinOp(left=left, op=ast.BitOr(), right=right):
                self.add(left, when)
                self.add(right, when)
            case ast.IfExp(test=test, body=body, orelse=other):
                self.add(body, _condition(test, holds=True))
                self.add(other, _condition(test, holds=False))
            case ast.Name(id=name) if name in self.groups:
                self.add(self.groups[name], when)
            case ast.Call(func=ast.Attribute(value=ast.Call(func=ast.Name(id="super")), attr="equations")):
                base = _read(self.bases)
                self.law.equations |= base.equations
                self.law.definitions |= base.definitions
                self.law.calls += base.calls
            case ast.Call(func=ast.Name(id="dict"), args=[], keywords=keywords):
                for one in keywords:
                    self.state(str(one.arg), one.value, when)
            case ast.Call(func=ast.Name(id=name)) if name != "dict":
                self.law.calls.append(re.sub(r"\b(self\.)?_?(?=\w)", "", ast.unparse(value)))
            case ast.Dict(keys=keys, values=values) if all(isinstance(key, ast.Constant) for key in keys):
                for key, one in zip(keys, values, strict=True):
                    self.state(str(key and ast.unparse(key)), one, when)
            case _:
                raise Unreadable

    def state(self, name: str, value: ast.expr, when: str) -> None:
        """One equation. A name that is stated under two conditions has two."""
        match value:
            case ast.Call(func=ast.Name(id="eq"), args=[left, *right]) if len(right) < 2:
                text = self.equality(left, right[0] if right else ast.Constant(value=0)) + when
                self.law.equations[name + when] = text
            case _:
                raise Unreadable

    def equality(self, left: ast.expr, right: ast.expr) -> str:
        return f"{formula(left, self.rates)}<mo>=</mo>{formula(right, self.rates)}"


def _condition(test: ast.expr, *, holds: bool) -> str:
    """The words for a test, such as "with heat" and "without heat" for an optional port."""
    text = ast.unparse(test).replace("self.", "")
    part, is_optional, rest = text.partition(" is ")
    if is_optional and rest in ("None", "not None"):
        words = f"{'with' if holds == (rest == 'not None') else 'without'} {part}"
    else:
        words = f"{'if' if holds else 'unless'} {text}"
    return f"<mtext> {html.escape(words)}</mtext>"


def _holds_equations(value: ast.expr) -> bool:
    """Whether a value is a dictionary of equations, or a choice between two."""
    match value:
        case ast.Dict():
            return True
        case ast.IfExp(body=body, orelse=other):
            return _holds_equations(body) or _holds_equations(other)
        case _:
            return isinstance(value, ast.Call) and ast.unparse(value.func) == "dict"
