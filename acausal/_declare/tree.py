"""Text and HTML of a model, or of a view of one: a tree of its parts, with values in their units."""

import dataclasses
import html
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from .._tracing import known
from .fields import dynamic_fields
from .node import Node, Port, parts_of

LINES = 200  # maximum length of a printed tree
FEW = 4  # longer arrays are summarised


class Branch(NamedTuple):
    """A part of a model with its values and parts; a port takes one line."""

    title: str
    is_port: bool
    values: list[tuple[str, str]]
    parts: list["Branch"]


def branch(node: Node, name: str = "") -> Branch:
    """The tree of a node: static fields, parameters, variables with values, and ports with values."""
    kind, node = node._shown()
    parts = [
        branch(part, path)
        for field, declaration in dynamic_fields(type(node))
        if declaration is None
        for path, part in parts_of(getattr(node, field), field)
        if not isinstance(part, Port) or _values(part)
    ]
    return Branch(f"{name}: {kind}" if name else kind, isinstance(node, Port), _values(node), parts)


def _values(node: Node) -> list[tuple[str, str]]:
    static = [field.name for field in dataclasses.fields(node) if field.metadata.get("static")]
    said = [(name, _short(repr(getattr(node, name)))) for name in static if _is_said(name, getattr(node, name))]
    leaves = [(name, declaration) for name, declaration in dynamic_fields(type(node)) if declaration is not None]
    given = [
        (declared.title or name, declared.unit, getattr(node, name))
        for name, declared in leaves
        if declared.title is not None
    ]
    return said + [(name, with_unit(value, unit)) for name, unit, value in given if value is not None]


def _is_said(name: str, value: object) -> bool:
    return not name.startswith("_") and value is not None and not (name == "nominal" and not value)


def _short(text: str, most: int = 60) -> str:
    return text if len(text) <= most else f"{text[: most - 4]} ..."


def with_unit(value: Any, unit: str) -> str:
    """A number, or the range of an array, with its unit."""
    numbers = known(value)
    numbers = None if numbers is None else numbers + 0.0  # no negative zeros
    if numbers is None:
        text = f"traced {np.shape(value)}" if np.ndim(value) else "traced"
    elif numbers.size <= FEW:
        text = np.array2string(numbers, separator=", ", formatter={"float": "{:.6g}".format})
    elif np.all(numbers == numbers.flat[0]):
        text = f"{_counted(numbers)} of {numbers.flat[0]:.6g}"
    else:
        text = f"{_counted(numbers)} from {np.min(numbers):.6g} to {np.max(numbers):.6g}"
    return f"{text} {unit}" if unit not in ("", "1") else text


def _counted(numbers: np.ndarray) -> str:
    return " × ".join(map(str, numbers.shape)) + " values"


def as_text(tree: Branch) -> str:
    """Text with two spaces for each level; a port takes one line."""
    lines = list(_lines(tree, 0))
    hidden = len(lines) - LINES
    return "\n".join(lines[:LINES] + ([f"... and {hidden} more lines: print a part of it"] if hidden > 0 else []))


def _lines(tree: Branch, level: int) -> Iterator[str]:
    if tree.is_port:
        yield "  " * level + ", ".join([tree.title, *(f"{name} = {text}" for name, text in tree.values)])
        return
    yield "  " * level + tree.title
    width = max((len(name) for name, _ in tree.values), default=0)
    for name, text in tree.values:
        yield "  " * (level + 1) + f"{name:{width}} = {text}"
    for part in tree.parts:
        yield from _lines(part, level + 1)


def as_html(tree: Branch, *, is_open: bool = True) -> str:
    """HTML with folding parts and tables of their values."""
    table = value_table(tree.values)
    parts = "".join(as_html(part, is_open=not part.parts) for part in tree.parts)
    name, _, kind = tree.title.rpartition(": ")
    title = f"{html.escape(name)} <b>{html.escape(kind)}</b>"
    if not table and not parts:
        return f'<div style="margin-left:2.2em">{title}</div>'
    state = " open" if is_open else ""
    return f'<details{state} style="margin-left:1em"><summary>{title}</summary>{table}{parts}</details>'


def folded(title: str, content: str) -> str:
    """HTML that opens with a click on its title."""
    return f'<details style="margin-left:1em"><summary>About {html.escape(title)}</summary>{content}</details>'


def value_table(values: Sequence[tuple[str, str]]) -> str:
    """HTML table of names and values."""
    cell = '<td style="text-align:left">{}</td>'
    rows = [f"<tr>{''.join(cell.format(html.escape(text)) for text in row)}</tr>" for row in values]
    return f'<table style="margin:0">{"".join(rows)}</table>' if rows else ""
