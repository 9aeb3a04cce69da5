"""Abstract values: the dimension of a value, and its text."""

import dataclasses
import math
from typing import Any

import numpy as np

from .._tracing import is_traced
from .._units.dimension import NUMBER, Dimension, described

_LONGEST = 60
_TINY = 1e-30  # a number this small guards a quotient and has any dimension, like zero

SUM, PRODUCT, ATOM = range(3)  # precedence of an expression


@dataclasses.dataclass(frozen=True)
class Value:
    """A value of a known `dimension`; None fits any.

    `unit`: the declared unit. `number`: the number of a constant. `leaf`: the input without a unit that has the same
    dimension.
    """

    dimension: Dimension | None
    text: str
    rank: int = ATOM
    unit: str | None = None
    number: float | None = None
    leaf: int | None = None

    def __str__(self) -> str:
        if self.dimension is None:
            return self.text
        return f"{self.text} in {described(self.dimension, self.unit)}"

    def within(self, rank: int) -> str:
        """Its text as part of an expression of precedence `rank` or higher."""
        return self.text if self.rank >= rank else f"({self.text})"


def written(dimension: Dimension | None, text: str, rank: int = ATOM, leaf: int | None = None) -> Value:
    """The value of an expression, with an abbreviated text if it is long."""
    if len(text) > _LONGEST:
        text, rank = text[: _LONGEST - 3].rstrip() + "...", ATOM
    return Value(dimension, text, rank, leaf=leaf)


def constant(value: Any) -> Value:
    """The value of a number. Zero, infinity and NaN fit any dimension."""
    if isinstance(value, float | int):
        is_any = abs(value) <= _TINY or not math.isfinite(value)
        return Value(None if is_any else NUMBER, f"{value:g}", number=float(value))
    if is_traced(value) or not np.size(value) or np.asarray(value).dtype.kind not in "biuf":
        return Value(None, "[...]")
    array = np.asarray(value, dtype=float)
    first = float(array.flat[0])
    uniform = bool(np.all(array == first))
    fits_all = bool(np.all((np.abs(array) <= _TINY) | ~np.isfinite(array)))
    text = f"{first:g}" if uniform else "[...]"
    return Value(None if fits_all else NUMBER, text, number=first if uniform else None)
