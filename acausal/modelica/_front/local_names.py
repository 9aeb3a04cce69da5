"""Functions and packages that models declare: the front end has one of each name for all models."""

import re
from collections.abc import Iterator
from typing import Any

from .._errors import ModelicaError
from .marks import MARKED_CLASSES
from .scan import class_kinds, masked
from .sources import Sources

_DECLARED = re.compile(
    r"\b(?:function|package)\s+(?P<name>\w+)\b(?:\s*=\s*(?P<value>[^;]*?)(?=\bconstrainedby\b|\bannotation\b|\"|;))?"
)


def check_local_names(content: dict[str, Any], sources: Sources) -> None:
    """Raises `ModelicaError` for a function, or a package with functions, that two models declare differently."""
    used = {name.partition(".")[0] for name in content["functions"]}
    first: dict[str, str] = {}
    for source, (_, text) in sources.texts.items():
        for name, at, value in _declared(text, source):
            if name in used and first.setdefault(name, value) != value:
                where = sources.where(source, len(text[:at].encode()))
                raise ModelicaError(
                    f"{where}another model declares {name}, too, and the front end takes one for the other. Remedy: "
                    "give them different names."
                )


def _declared(text: str, source: int) -> Iterator[tuple[str, int, str]]:
    """The functions and packages that models declare: their names and places, and what they are, which is unique for
    those with a body.
    """
    plain = masked(text)
    kinds = class_kinds(plain)
    for found in _DECLARED.finditer(plain):
        at = found.start()
        before = plain[plain.rfind(";", 0, at) + 1 : at]
        is_element = before.count("(") <= before.count(")") and not re.search(r"\bend\s+$", before)
        if is_element and kinds(at - 1) in MARKED_CLASSES:
            value = found["value"]
            yield found["name"], at, f"{source} {at}" if value is None else "".join(value.split())
