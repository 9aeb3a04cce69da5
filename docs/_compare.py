"""Whether two texts say the same, numbers up to rounding."""

import math
import re

_NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+\.\d*|\.\d+|\d+)(?:e[-+]?\d+)?(?![\w.]*:)", re.IGNORECASE)
_NOISE = re.compile(r"imbalance: \S+ J|\d+ steps accepted, \d+ rejected")  # errors of the integration


def first_difference(expected: str, found: str, rtol: float = 1e-4) -> str | None:
    """The first pair of lines that differ, one below the other; None where there is none."""
    a, b = (_NOISE.sub("...", text).splitlines() for text in (expected, found))
    for left, right in zip(a, b, strict=False):
        if not _same(left, right, rtol):
            return f"expected: {left}\n   found: {right}"
    return None if len(a) == len(b) else f"{len(a)} lines expected, {len(b)} found"


def _same(left: str, right: str, rtol: float) -> bool:
    if left == right:
        return True
    numbers = [[float(text) for text in _NUMBER.findall(line)] for line in (left, right)]
    words = [re.sub(r"\s+", " ", _NUMBER.sub("#", line)) for line in (left, right)]
    same_numbers = len(numbers[0]) == len(numbers[1]) and all(
        math.isclose(x, y, rel_tol=rtol, abs_tol=1e-12) for x, y in zip(*numbers, strict=True)
    )
    return words[0] == words[1] and same_numbers
