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
        found = _read(cls, list(cls.__mro__))
    except Unreadable:
        yield f"\n**Equations**\n\n```python\n{textwrap.dedent(inspect.getsource(cls.equations)).rstrip()}\n```"
        return
    yield f"\n**Equations**\n\n{_lines(found.equations)}\n"
    if found.definitions:
        yield f"\nwith\n\n{_lines(found.definitions)}\n"
    if found.calls:
        yield f"\nand the equations of {', '.join(f'`{call}`' for call in found.calls)}.\n"


def expression(text: str) -> str:
    """An expression of attributes of a component, which are written without `self`, as a formula or as code."""
    try:
        return f"<math>{formula(_OfSelf().visit(ast.parse(text, mode='eval').body), '')}</math>"
    except Unreadable:
        return f"`{text}`"


class _OfSelf(ast.NodeTransformer):
    """Turns names other than those of functions into attributes of `self`."""

    def visit_Name(self, node: ast.Name) -> ast.Attribute:
        return ast.Attribute(ast.Name("self"), node.id)

    def visit_Call(self, node: ast.Call) -> ast.Call:
        return ast.Call(node.func, [self.visit(one) for one in node.args], node.keywords)


def _lines(formulas: dict[str, str]) -> str:
    shown = "".join(f'<div><math displaystyle="true">{one}</math></div>' for one in dict.fromkeys(formulas.values()))
    return f'<div class="law">{shown}</div>'


def _read(cls: Any, order: list[Any]) -> _Law:
    """The equations of the first class in the order that states any, with those of its bases that it adds to."""
    while "equations" not in vars(order[0]):
        order = order[1:]
    if order[0] is Component:
        return _Law()
    function = _parsed(vars(order[0])["equations"])
    reader = _Reader(cls, function.args.args[1].arg, order[1:])
    reader.statements(function.body, "")
    reader.helpers(function)
    return reader.law


def _parsed(method: Any) -> ast.FunctionDef:
    function = ast.parse(textwrap.dedent(inspect.getsource(method))).body[0]
    assert isinstance(function, ast.FunctionDef)
    return function


class _Reader:
    """Reads a method `equations`; `groups` are local variables that hold equations."""

    def __init__(self, cls: Any, rates: str, bases: list[Any]) -> None:
        self.cls, self.rates, self.bases, self.law = cls, rates, bases, _Law()
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
                base = _read(self.cls, self.bases)
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

    def helpers(self, function: ast.FunctionDef) -> None:
        """Defines the methods and properties of the component that a method uses, if each is one expression."""
        for node in ast.walk(function):
            match node:
                case ast.Attribute(value=ast.Name(id="self"), attr=name) if name not in self.law.definitions:
                    found = inspect.getattr_static(self.cls, name, None)
                    method = found.fget if isinstance(found, property) else found
                    if inspect.isfunction(method) and method is not self.cls.equations:
                        self.define(name, _parsed(method), is_called=method is found)

    def define(self, name: str, function: ast.FunctionDef, *, is_called: bool) -> None:
        *rest, last = function.body
        arguments = [ast.Name(one.arg) for one in function.args.args[1:]]
        if isinstance(last, ast.Return) and last.value and all(isinstance(one, ast.Expr) for one in rest):
            try:
                left = ast.Call(ast.Name(name), list[ast.expr](arguments), []) if is_called else ast.Name(name)
                self.law.definitions[name] = self.equality(left, last.value)
                self.helpers(function)
            except Unreadable:
                return

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
    return f"<mtext>&#160;&#160;{html.escape(words)}</mtext>"


def _holds_equations(value: ast.expr) -> bool:
    """Whether a value is a dictionary of equations, or a choice between two."""
    match value:
        case ast.Dict():
            return True
        case ast.IfExp(body=body, orelse=other):
            return _holds_equations(body) or _holds_equations(other)
        case _:
            return isinstance(value, ast.Call) and ast.unparse(value.func) == "dict"
