"""Comparison of texts, with numbers up to rounding, and of pictures."""

import io
import math
import re
from xml.etree import ElementTree

import matplotlib.image as mpimg
import numpy as np

_NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+\.\d*|\.\d+|\d+)(?:e[-+]?\d+)?(?![\w.]*:)", re.IGNORECASE)
# Integration errors, residuals of optima, and run times.
_NOISE = re.compile(r"imbalance: \S+ J|KKT residual \S+,|\d+ designs[^\n]*, \S+ s")
_STEPS = re.compile(r"\d+ steps accepted, \d+ rejected")
ALIKE = 0.01  # largest difference of pictures due to rounding
MORE_STEPS = (0.1, 2)  # relative and absolute change of the number of steps due to rounding


def first_difference(expected: str, found: str, rtol: float = 1e-4, atol: float = 1e-12) -> str | None:
    """The first pair of lines that differ, one below the other; None if there is none."""
    a, b = (_NOISE.sub("...", text).splitlines() for text in (expected, found))
    for left, right in zip(a, b, strict=False):
        if not _same(left, right, rtol, atol):
            return f"expected: {left}\n   found: {right}"
    return None if len(a) == len(b) else f"{len(a)} lines expected, {len(b)} found"


def _same(left: str, right: str, rtol: float, atol: float) -> bool:
    if left == right:
        return True
    numbers = [[float(text) for text in _NUMBER.findall(line)] for line in (left, right)]
    words = [re.sub(r"\s+", " ", _NUMBER.sub("#", line)) for line in (left, right)]
    rel_tol, abs_tol = MORE_STEPS if _STEPS.search(left) else (rtol, atol)
    same_numbers = len(numbers[0]) == len(numbers[1]) and all(
        math.isclose(x, y, rel_tol=rel_tol, abs_tol=abs_tol) for x, y in zip(*numbers, strict=True)
    )
    return words[0] == words[1] and same_numbers


def picture_difference(expected: bytes, found: bytes) -> float:
    """The root-mean-square difference of the colours of two PNG pictures; 1 between black and white.

    SVG pictures are the same if they have the same words: equally good layouts depend on rounding.
    """
    if expected.startswith(b"<svg"):
        return 0.0 if _svg_words(expected) == _svg_words(found) else math.inf
    a, b = (
        np.asarray(mpimg.imread(io.BytesIO(picture), format="png"), float)[..., :3] for picture in (expected, found)
    )
    return float(np.sqrt(np.mean((a - b) ** 2))) if a.shape == b.shape else math.inf


def _svg_words(picture: bytes) -> list[str]:
    found = ElementTree.fromstring(picture).iter()
    return sorted(element.text or "" for element in found if element.tag.rpartition("}")[2] in ("text", "title"))
