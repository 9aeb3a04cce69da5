"""Marks that show in the flat model which components are inner and outer: constants beside them."""

import re
from collections.abc import Iterator
from typing import Any

from .marks import MARKED_CLASSES, joined, mark, marks, without_brackets
from .scan import KINDS, class_kinds, masked, statement_end

_DECLARATION = re.compile(
    r"(?<![\w.])(?P<scopes>(?:(?:inner|outer)\s+)+)(?:(?:replaceable|parameter|constant|discrete|input|output|flow)\s+)*"
    rf"(?!(?:partial|encapsulated|expandable|pure|impure|{KINDS})\b)[\w.]+\s*(?P<names>)"
)


def marked(text: str) -> str:
    """A text with a constant after each declaration of inner or outer components of a model."""
    if not re.search(r"\b(?:inner|outer)\b", text):
        return text
    plain = masked(text)
    kinds = class_kinds(plain)
    pieces, at = [], 0
    for found in _DECLARATION.finditer(plain):
        if kinds(found.start()) in MARKED_CLASSES:
            end = statement_end(plain, found.start())
            names = [one.split()[0] for one in without_brackets(plain[found.end() : end - 1]).split(",")]
            added = [mark(scope, name) for scope in found["scopes"].split() for name in names]
            pieces += [text[at:end], *(f" constant Boolean {one} = true;" for one in added)]
            at = end
    return "".join([*pieces, text[at:]])


def outer_components(content: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """The paths of the outer components of a flat model, each with the path of its inner component (Modelica 3.6,
    section 5.4).
    """
    inner = {joined(path, name) for path, _, name, _ in marks(content, "inner")}
    for path, _, name, _ in marks(content, "outer"):
        if joined(path, name) not in inner:
            around = next((one for one in _around(path) if joined(one, name) in inner), None)
            if around is not None:
                yield joined(path, name), joined(around, name)


def _around(path: str) -> Iterator[str]:
    """The paths of the components around a component, from the nearest."""
    while path:
        path = path.rpartition(".")[0]
        yield path
