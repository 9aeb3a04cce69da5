"""Sizes and ranges that the front end loses without a message, because they read an element of an array."""

import re

from .._errors import ModelicaError
from .scan import class_kinds, masked, section_of
from .sources import Sources

_ELEMENT = r"[^\[\];()]*\w\s*\[[^;]*?"
_RANGE = re.compile(rf"\bfor\s+\w+\s+in\s+(?P<size>{_ELEMENT})\bloop\b")
_WORDS = "then|else|elseif|if|when|elsewhen|loop|in|and|or|not|while|return|equation|algorithm"
_PART = re.compile(
    rf"(?<![\w.])(?!(?:{_WORDS})\b)[\w.]+\s+\w+\s*\[(?P<size>{_ELEMENT}\][^;\]]*?)\]\s*(?:[;(,\"]|if\b|annotation\b)"
)
_REMEDY = "Remedy: declare an Integer parameter with a value of its own, and use that."


def check_sizes(sources: Sources) -> None:
    """Raises `ModelicaError` for a loop of equations or an array of components whose size reads an element of an array,
    as in `for i in 1:n[2] loop` and `Part part[n[2]]`.
    """
    for source, (_, text) in sources.texts.items():
        plain = masked(text)
        for found in (*_RANGE.finditer(plain), *_PART.finditer(plain)):
            is_range, at = found.re is _RANGE, found.start()
            in_equations = section_of(plain, at) == "equation"
            if in_equations == is_range and (is_range or class_kinds(plain)(at) != "function"):
                where, size = sources.where(source, len(plain[:at].encode())), found["size"].strip()
                raise ModelicaError(f"{where}the front end loses the size {size}, which reads an array. {_REMEDY}")
