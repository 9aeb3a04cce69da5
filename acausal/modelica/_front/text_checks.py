"""Ranges and attributes that the front end loses, or evaluates, without a trace in the flat model."""

import re
from collections.abc import Iterator

from .._errors import ModelicaError
from .scan import masked, section_of
from .sources import Sources

_RANGE = re.compile(r"\bfor\s+\w+\s+in\s+(?P<size>[^\[\];()]*\w\s*\[[^;]*?)\bloop\b")
_FIXED = re.compile(r"\bfixed\s*=(?!=)\s*(?P<value>[^,;)]*?(?:[<>]|==)[^,;)]*)")


def check_texts(sources: Sources) -> None:
    """Raises `ModelicaError` for a loop of equations whose range reads an element of an array, as in
    `for i in 1:n[2] loop`, and for an attribute `fixed` that is a relation, as in `x(fixed = k > 1)`.
    """
    for source, (_, text) in sources.texts.items():
        for at, error in _errors(masked(text)):
            raise ModelicaError(f"{sources.where(source, len(text[:at].encode()))}{error}")


def _errors(plain: str) -> Iterator[tuple[int, str]]:
    for found in _RANGE.finditer(plain):
        if section_of(plain, found.start()) == "equation":
            yield (
                found.start(),
                f"the front end loses the range {found['size'].strip()}, which reads an array. Remedy: declare an "
                "Integer parameter with a value of its own, and use that.",
            )
    for found in _FIXED.finditer(plain):
        yield (
            found.start(),
            f"fixed = {found['value'].strip()} is evaluated when the model is loaded. Remedy: declare a Boolean "
            "parameter with this value, and use that.",
        )
