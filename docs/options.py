"""Table of the options of a function, generated from its signature and docstring."""

import inspect
import re
import textwrap
from collections.abc import Callable, Iterator
from typing import Any

WIDTH, NAME, DEFAULT = 110, 12, 9
_ENTRY = re.compile(r"^- `(?P<name>\w+)(?:\(\w*\))?`: (?P<meaning>.*(?:\n  .*)*)", re.MULTILINE)


def options(function: Callable[..., Any]) -> str:
    """Name, default and meaning of each argument that has a default."""
    meanings = {entry["name"]: " ".join(entry["meaning"].split()) for entry in _entries(function)}
    lines = []
    for name, parameter in inspect.signature(function).parameters.items():
        if parameter.default is not parameter.empty:
            head = f"{name:{NAME}}{parameter.default!r:{DEFAULT}}"
            lines += textwrap.wrap(head + meanings[name], WIDTH, subsequent_indent=" " * (NAME + DEFAULT))
    return "\n".join(lines)


def _entries(function: Callable[..., Any]) -> Iterator[re.Match[str]]:
    return _ENTRY.finditer(inspect.getdoc(function) or "")
