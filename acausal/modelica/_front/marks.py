"""Marks: constants and parameters added to the text, by which the flat model shows what it does not show itself."""

import re
from collections.abc import Iterator
from typing import Any

_MARK = "acausalElement"
_BRACKETS = re.compile(r"\([^()]*\)|\[[^\[\]]*\]|\{[^{}]*\}")
MARKED_CLASSES = ("model", "block", "class")


def mark(kind: str, name: str) -> str:
    """The name of a mark."""
    return f"{_MARK}_{kind}_{name}"


def marks(content: dict[str, Any], *kinds: str) -> Iterator[tuple[str, str, str, dict[str, Any]]]:
    """The marks of some kinds in a flat model: the path of the component around each, its kind and name, and its
    variable.
    """
    for full, variable in content["variables"].items():
        path, _, last = full.rpartition(".")
        if last.startswith(f"{_MARK}_"):
            kind, _, name = last.removeprefix(f"{_MARK}_").partition("_")
            if kind in kinds:
                yield path, kind, name, variable


def unmarked(content: dict[str, Any]) -> dict[str, Any]:
    """The flat model without marks."""
    parts = ("variables", "variable_type_names", "variable_final_flags")
    return content | {
        part: {name: value for name, value in content[part].items() if not is_mark(name)} for part in parts
    }


def is_mark(name: str) -> bool:
    """Whether a variable is a mark."""
    return name.rpartition(".")[2].startswith(f"{_MARK}_")


def without_brackets(text: str) -> str:
    """A masked text with blanks for what is in brackets."""
    while (plain := _BRACKETS.sub(lambda found: " " * len(found[0]), text)) != text:
        text = plain
    return text


def joined(path: str, name: str) -> str:
    """The path of an element of a component."""
    return f"{path}.{name}" if path else name
