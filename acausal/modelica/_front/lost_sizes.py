"""Sizes and ranges that the front end loses without a message, because they read an element of an array."""

import re

from .._errors import ModelicaError
from .scan import class_kinds, masked
from .sources import Sources

_ELEMENT = r"[^\[\];()]*\w\s*\[[^;]*?"
_RANGE = re.compile(rf"\bfor\s+\w+\s+in\s+(?P<size>{_ELEMENT})\bloop\b")
_WORDS = "then|else|elseif|if|when|elsewhen|loop|in|and|or|not|while|return|equation|algorithm"
_PART = re.compile(
    rf"(?<![\w.])(?!(?:{_WORDS})\b)[\w.]+\s+\w+\s*\[(?P<size>{_ELEMENT}\][^;\]]*?)\]\s*(?:[;(,\"]|if\b|annotation\b)"
)
_SECTION = re.compile(
    r"(?<![\w.])(?:(?P<equations>equation)|algorithm|public|protected|model|block|class|record|package)\b"
)
_REMEDY = "Remedy: declare an Integer parameter with a value of its own, and use that."


def check_sizes(sources: Sources) -> None:
    """Raises `ModelicaError` for a loop of equations or an array of components whose size reads an element of an array,
    as in `for i in 1:n[2] loop` and `Part part[n[2]]`.
    """
    for source, (_, text) in sources.texts.items():
        plain = masked(text)
        for found in (*_RANGE.finditer(plain), *_PART.finditer(plain)):
            sections = [bool(section["equations"]) for section in _SECTION.finditer(plain, 0, found.start())]
            in_equations = sections[-1:] == [True]
            is_range = found.re is _RANGE
            if in_equations == is_range and (is_range or class_kinds(plain)(found.start()) != "function"):
                place = sources.place(source, len(plain[: found.start()].encode()))
                where = f"{place[0]}, line {place[1]}: " if place else ""
                raise ModelicaError(
                    f"{where}the front end loses the size {found['size'].strip()}, which reads an array. {_REMEDY}"
                )
