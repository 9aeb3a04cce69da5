"""Strings: the functions of ModelicaStrings. Positions count from 1."""

import re
from collections.abc import Callable
from typing import Any

_INTEGER = re.compile(r"[+-]?\d+(?![\d.eE])")
_REAL = re.compile(r"[+-]?(\d+\.?\d*|\.\d*)([eE][+-]?\d+)?(?![eE])")
_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_STRING = re.compile(r'"((?:[^"\\]|\\.)+)"')


def _substring(text: str, start: int, end: int) -> str:
    start = max(start, 1)
    return text[start - 1 : start if end < 0 else end]


def _compare(a: str, b: str, case_sensitive: bool = True) -> int:
    if not case_sensitive:
        a, b = a.lower(), b.lower()
    return 1 if a < b else 2 if a == b else 3


def _skip_white_space(text: str, start: int = 1) -> int:
    while start <= len(text) and text[start - 1].isspace():
        start += 1
    return start


def _scan(pattern: re.Pattern[str], read: Callable[[str], Any], missing: Any, *, signed: bool) -> Callable[..., Any]:
    def call(text: str, start: int = 1, unsigned: bool = False) -> tuple[int, Any]:
        found = pattern.match(text, _skip_white_space(text, start) - 1)
        if found is None or (signed and unsigned and found[0][0] in "+-"):
            return start, missing
        return found.end() + 1, read(found[0])

    return call


def _hash(text: str) -> int:
    """The hash function AP by Arash Partow, as a signed number of 32 bits."""
    mask, found = 0xFFFFFFFF, 0xAAAAAAAA
    for i, byte in enumerate(text.encode()):
        if i % 2 == 0:
            found ^= (found << 7) ^ (byte * (found >> 3))
        else:
            found ^= ~((found << 11) + (byte ^ (found >> 5)))
        found &= mask
    return found - (1 << 32) if found >= 1 << 31 else found


FUNCTIONS: dict[str, Callable[..., Any]] = {
    "ModelicaStrings_length": len,
    "ModelicaStrings_substring": _substring,
    "ModelicaStrings_compare": _compare,
    "ModelicaStrings_skipWhiteSpace": _skip_white_space,
    "ModelicaStrings_hashString": _hash,
    "ModelicaStrings_scanInteger": _scan(_INTEGER, int, 0, signed=True),
    "ModelicaStrings_scanReal": _scan(_REAL, float, 0.0, signed=True),
    "ModelicaStrings_scanIdentifier": _scan(_IDENTIFIER, str, "", signed=False),
    "ModelicaStrings_scanString": _scan(_STRING, lambda text: text[1:-1], "", signed=False),
}
