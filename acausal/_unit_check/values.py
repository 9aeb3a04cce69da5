"""What is known of a value in place of its number: its dimension, and how it is written."""

import dataclasses
import math
from typing import Any

import numpy as np

from .._tracing import is_traced
from .._units.dimension import NUMBER, Dimension, described

_LONGEST = 60
_TINY = 1e-30  # a number this small keeps a quotient finite, and has any dimension, as zero has

SUM, PRODUCT, ATOM = range(3)  # how tightly an expression binds


@dataclasses.dataclass(frozen=True)
class Value:
    """A value whose `dimension` is known, or None where it fits any.

    `unit`: as declared. `number`: where it is a constant. `leaf`: the input without a unit that it has the dimension
    of.
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
        """Its text as part of an expression that binds at least as tightly as `rank`."""
        return self.text if self.rank >= rank else f"({self.text})"


def written(dimension: Dimension | None, text: str, rank: int = ATOM, leaf: int | None = None) -> Value:
    """The value of an expression, abbreviated where it is long."""
    if len(text) > _LONGEST:
        text, rank = text[: _LONGEST - 3].rstrip() + "...", ATOM
    return Value(dimension, text, rank, leaf=leaf)


def constant(value: Any) -> Value:
    """A number; one that is zero, infinite or not a number fits any dimension."""
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
