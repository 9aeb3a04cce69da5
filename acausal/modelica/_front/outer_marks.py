"""Marks in the text that show in the flat model which components are inner and outer: constants beside them."""

import re
from collections.abc import Iterator
from typing import Any

from .scan import KINDS, class_kinds, masked, statement_end

_MARK = "acausalElement"
_DECLARATION = re.compile(
    r"(?<![\w.])(?P<scopes>(?:(?:inner|outer)\s+)+)(?:(?:replaceable|parameter|constant|discrete|input|output|flow)\s+)*"
    rf"(?!(?:partial|encapsulated|expandable|pure|impure|{KINDS})\b)[\w.]+\s*(?P<names>)"
)
_BRACKETS = re.compile(r"\([^()]*\)|\[[^\[\]]*\]|\{[^{}]*\}")


def marked(text: str) -> str:
    """A text with a constant after each declaration of inner or outer components of a model."""
    if not re.search(r"\b(?:inner|outer)\b", text):
        return text
    plain = masked(text)
    kinds = class_kinds(plain)
    pieces, at = [], 0
    for found in _DECLARATION.finditer(plain):
        if kinds(found.start()) in ("model", "block", "class"):
            end = statement_end(plain, found.start())
            names = _names(plain[found.end() : end - 1])
            marks = [_mark(scope, name) for scope in found["scopes"].split() for name in names]
            pieces += [text[at:end], *(f" constant Boolean {mark} = true;" for mark in marks)]
            at = end
    return "".join([*pieces, text[at:]])


def _names(declared: str) -> list[str]:
    """The names in a masked declaration without its type."""
    while (plain := _BRACKETS.sub(" ", declared)) != declared:
        declared = plain
    return [one.split()[0] for one in declared.split(",")]


def _mark(scope: str, name: str) -> str:
    return f"{_MARK}_{scope}_{name}"


def outer_components(content: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """The paths of the outer components of a flat model, each with the path of its inner component (Modelica 3.6,
    section 5.4).
    """
    marks = dict.fromkeys(name for name in content["variables"] if _is_mark(name))
    for path, _, mark in (name.rpartition(".") for name in marks):
        scope, _, name = mark.removeprefix(f"{_MARK}_").partition("_")
        inner = _mark("inner", name)
        if scope == "outer" and _in(path, inner) not in marks:
            around = next((one for one in _around(path) if _in(one, inner) in marks), None)
            if around is not None:
                yield _in(path, name), _in(around, name)


def _around(path: str) -> Iterator[str]:
    """The paths of the components around a component, from the nearest."""
    while path:
        path = path.rpartition(".")[0]
        yield path


def _in(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name


def _is_mark(name: str) -> bool:
    return name.rpartition(".")[2].startswith(_MARK)


def unmarked(content: dict[str, Any]) -> dict[str, Any]:
    """The flat model without marks."""
    parts = ("variables", "variable_type_names", "variable_final_flags")
    return content | {
        part: {name: value for name, value in content[part].items() if not _is_mark(name)} for part in parts
    }
