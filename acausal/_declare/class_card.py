"""Content of the documentation of a component class: its text, parameters, ports, variables and energy account."""

import ast
import dataclasses
import functools as ft
import html
import inspect
import io
import itertools
import re
import textwrap
import tokenize
import types
import typing
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from .annotations import Declaration
from .component import Component, Energy
from .fields import dynamic_fields
from .node import Node, Port, Record


class Row(NamedTuple):
    """One argument, port or variable. `kind` is its unit, or its class."""

    name: str
    kind: str = ""
    range: str = ""
    default: str = ""
    meaning: str = ""


class Card(NamedTuple):
    """Documentation of a class: its own text, and a table for each heading."""

    name: str
    text: str
    tables: dict[str, list[Row]]


def card_of(cls: Any) -> Card:
    """The documentation of a class of components, ports or records."""
    tables = {
        "Parameters": list(parameters(cls)),
        "Options": list(_options(cls)),
        "Parts": list(parts(cls, (Component, Record))),
        "Ports": list(parts(cls, Port)),
        "Variables": list(_variables(cls)),
        "Energy": [Row(*term) for term in energy_terms(cls)],
    }
    return Card(cls.__name__, own_text(cls), {heading: rows for heading, rows in tables.items() if rows})


def own_text(cls: type) -> str:
    """The docstring in the source of a class."""
    return inspect.cleandoc(vars(cls)["__doc__"])


def parameters(cls: Any) -> Iterator[Row]:
    """The parameters of the constructor."""
    declarations = _declarations(cls)
    for name, argument in _arguments(cls).items():
        declaration = declarations.get(name)
        if declaration is not None and declaration.role == "param":
            unit, default = declaration.unit or "any unit", _default(argument)
            yield Row(name, unit, _range(declaration), default, _meaning(cls, name))


def parts(cls: Any, of: Any) -> Iterator[Row]:
    """The parts of one kind, including those that the constructor creates."""
    hints, arguments = _hints(cls), _arguments(cls)
    for field in dataclasses.fields(cls):
        hint = hints.get(field.name, field.type)
        kinds = [hint, *typing.get_args(hint)]
        found = [kind for kind in kinds if isinstance(kind, type) and issubclass(kind, of)]
        if found:
            has_default = of is not Port and field.name in arguments and _default(arguments[field.name])
            default = "optional" if has_default or types.NoneType in kinds else ""
            yield Row(field.name, found[0].__name__, _units(found[0]), default, _meaning(cls, field.name))


def _options(cls: Any) -> Iterator[Row]:
    """The remaining arguments of the constructor, such as the number of segments."""
    known = {name for name, _ in dynamic_fields(cls)} | _declarations(cls).keys() | {"nominal"}
    hints = _hints(cls.__init__)
    for name, argument in _arguments(cls).items():
        hint = hints.get(name, argument.annotation)
        if name not in known:
            kind = "" if hint is Any or hint is argument.empty else inspect.formatannotation(hint).rpartition(".")[2]
            yield Row(name, kind, "", _default(argument), _meaning(cls, name))


def _variables(cls: Any) -> Iterator[Row]:
    for name, declaration in dynamic_fields(cls):
        if declaration is not None and declaration.role != "param":
            start = f"= {declaration.start:g}" if isinstance(declaration.start, float) and declaration.start else ""
            yield Row(name, declaration.unit, _range(declaration), start, _meaning(cls, name))


def _arguments(cls: Any) -> Mapping[str, inspect.Parameter]:
    """The arguments of the constructor by name."""
    return dict(list(inspect.signature(cls.__init__).parameters.items())[1:])


def _default(argument: inspect.Parameter) -> str:
    if argument.default in (inspect.Parameter.empty, dataclasses.MISSING):
        return ""
    return f"= {argument.default:g}" if isinstance(argument.default, float | int) else "optional"


def _range(declaration: Declaration) -> str:
    """The admissible range and the shape."""
    words = [one.name for one in declaration.ranges]
    words += ["unbounded"] if declaration.is_unbounded else []
    words += [f"shape ({', '.join(map(str, declaration.sizes))})"] if declaration.sizes else []
    return ", ".join(words)


def _units(kind: Any) -> str:
    """The variables of a port with their units."""
    declared = dynamic_fields(kind) if issubclass(kind, Port) else ()
    return ", ".join(f"{name} in {leaf.unit}" for name, leaf in declared if leaf is not None and leaf.unit)


def _declarations(cls: Any) -> dict[str, Declaration]:
    """The declarations of fields, and those inside the annotations of a constructor of its own."""
    inside = {name: _inside(hint) for name, hint in _hints(cls.__init__).items()}
    found = inside | {field.name: field.metadata.get("declaration") for field in dataclasses.fields(cls)}
    found |= {name: inside.get(name) for name, one in found.items() if one is None}
    return {name: declaration for name, declaration in found.items() if declaration is not None}


def _inside(hint: Any) -> Declaration | None:
    """The declaration inside an annotation, an optional one included."""
    if isinstance(hint, Declaration):
        return hint
    found = [_inside(part) for part in (*getattr(hint, "__metadata__", ()), *typing.get_args(hint))]
    return next((one for one in found if one is not None), None)


def _hints(item: Any) -> dict[str, Any]:
    """The annotations of a class or a function; empty if they refer to names that do not exist at run time."""
    try:
        return typing.get_type_hints(item, include_extras=True)
    except NameError:
        return {}


def _meaning(cls: Any, name: str) -> str:
    """The comment behind the declaration of a name, in the class or one of its bases, and its names in MSL."""
    elsewhere = getattr(cls, "elsewhere", {}).items()
    others = [other for other, here in elsewhere if name in re.findall(r"\w+", here.split(",")[0])]
    known = f" (MSL {', '.join(others)})" if others else ""
    return (comment_of(cls, name) + known).strip()


def comment_of(cls: Any, name: str) -> str:
    """The comment behind the declaration of a name, in the class or one of its bases; "" if there is none."""
    bases: list[Any] = [base for base in cls.__mro__ if issubclass(base, Node)]
    return next((found for base in bases if (found := _comments(base).get(name))), "")


@ft.cache
def _comments(cls: Any) -> dict[str, str]:
    """The comment on the first or the last line of each declaration in the source of a class, by name."""
    found: dict[str, str] = {}
    name, depth, outside, first = "", 0, 0, 0
    tokens = list(tokenize.generate_tokens(io.StringIO(_source(cls)).readline))
    for token, after in itertools.pairwise(tokens):
        is_first = not token.line[: token.start[1]].strip()
        if token.type == tokenize.NAME and is_first and after.string == ":" and not (name and depth > outside):
            name, outside, first = token.string, depth, token.start[0]
        depth += (token.string in ("(", "[", "{")) - (token.string in (")", "]", "}"))
        if token.type == tokenize.COMMENT and name and (depth == outside or token.start[0] == first):
            found.setdefault(name, re.sub(r"^# *(?:noqa: \w+  # *)?", "", token.string))
        if token.type in (tokenize.NEWLINE, tokenize.NL) and depth <= outside:
            name = ""
    return found


@ft.cache
def _source(cls: Any) -> str:
    """The source of a class; empty if there is none, as in a frozen program.

    A method leads to it where there is one: `inspect` finds the first class of that name in a file, and none in a
    notebook.
    """
    found = [getattr(cls, name) for name in vars(cls) if not name.startswith("__")]
    methods = [item for item in found if inspect.isfunction(item) and item.__qualname__.startswith(cls.__qualname__)]
    try:
        return _around(methods[0], cls.__name__) if methods else inspect.getsource(cls)
    except (OSError, TypeError, SyntaxError):
        return ""


def _around(method: Any, name: str) -> str:
    """The source of the class of this name in which a method is written."""
    lines, start = inspect.findsource(method)
    for node in ast.walk(ast.parse("".join(lines))):
        if isinstance(node, ast.ClassDef) and node.name == name and start in range(node.lineno, node.end_lineno or 0):
            return "".join(lines[node.lineno - 1 : node.end_lineno])
    return ""


def as_text(card: Card) -> str:
    """The text of the class, and its tables with aligned columns."""
    return "\n\n".join([card.text, *(f"{heading}:\n{_aligned(rows)}" for heading, rows in card.tables.items())]).strip()


def _aligned(rows: list[Row]) -> str:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  ".join(f"{text:{width}}" for text, width in zip(row, widths, strict=True) if width) for row in rows]
    return "\n".join(f"    {line.rstrip()}" for line in lines)


def as_html(card: Card) -> str:
    """The same as a card."""
    tables = "".join(f"<p><b>{heading}</b></p>{_table(rows)}" for heading, rows in card.tables.items())
    text = html.escape(card.text)
    return f'<div><b>{card.name}</b><p style="white-space:pre-wrap">{text}</p>{tables}</div>'


def _table(rows: list[Row]) -> str:
    used = [any(column) for column in zip(*rows, strict=True)]
    lines = [[text for text, is_used in zip(row, used, strict=True) if is_used] for row in rows]
    return "<table>" + "".join(f"<tr>{''.join(map(_cell, line))}</tr>" for line in lines) + "</table>"


def _cell(text: str) -> str:
    return f'<td style="text-align:left">{html.escape(text)}</td>'


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
