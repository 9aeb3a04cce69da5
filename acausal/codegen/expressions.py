"""Expressions of C: their text and how tightly they bind."""

import math
import re
from typing import Any, NamedTuple

import numpy as np

# How tightly an expression binds, from the loosest.
CHOICE, LOGIC, RELATION, SUM, PRODUCT, SIGN, ATOM = range(7)
TYPES = {"f": "double", "b": "int", "i": "int", "u": "unsigned"}  # by the kind of a dtype of NumPy
_RESERVED = frozenset(
    """
    auto break case char const continue default do double else enum extern float for goto if inline int long register
    restrict return short signed sizeof static struct switch typedef union unsigned void volatile while
    acos acosh asin asinh atan atan2 atanh cbrt ceil cos cosh erf erfc exp exp2 expm1 fabs floor fmod gamma hypot j0 j1
    jn lgamma log log10 log1p log2 main nextafter pow rint round sin sinh sqrt tan tanh y0 y1 yn
    INFINITY NAN isfinite isnan
    abs_int larger larger_int logistic power power_int sign_of sign_of_int smaller smaller_int square within
    """.split()
)


class Expression(NamedTuple):
    text: str
    level: int = ATOM

    def inside(self, level: int) -> str:
        """The text as an operand of an operator that binds as tightly as `level`."""
        return self.text if self.level >= level else f"({self.text})"


def dtype_of(atom: Any) -> np.dtype:
    """The type of a variable or literal of a jaxpr."""
    return np.dtype(atom.aval.dtype)


def kind_of(atom: Any) -> str:
    """The key of this type in `TYPES`."""
    return dtype_of(atom).kind


def number(value: float | int | bool, kind: str) -> Expression:
    """A number, exact to the last bit."""
    if kind != "f":
        text = f"{int(value)}{'u' if kind == 'u' else ''}"
    elif math.isnan(value):
        text = "NAN"
    elif math.isinf(value):
        text = "INFINITY" if value > 0 else "-INFINITY"
    else:
        text = repr(float(value))
    return Expression(text, SIGN if text.startswith("-") else ATOM)


def call(function: str, *args: Expression) -> Expression:
    return Expression(f"{function}({', '.join(arg.text for arg in args)})")


def identifier(name: str) -> str:
    """A name of a model as one of C: `a.b[3]` becomes `a_b_3`."""
    text = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_") or "_"
    text = f"_{text}" if text[0].isdigit() else text
    return f"{text}_" if text in _RESERVED else text


class Names:
    """Different names of C within one scope."""

    def __init__(self) -> None:
        self._used: set[str] = set()

    def new(self, name: str) -> str:
        """The name itself, or with a number if it is taken."""
        found = base = identifier(name)
        count = 1
        while found in self._used:
            count += 1
            found = f"{base}_{count}" if base[-1].isdigit() else f"{base}{count}"
        self._used.add(found)
        return found

    def loop(self) -> str:
        """A name for the variable of a loop, free again after `release`."""
        free = [name for name in "ijklmn" if name not in self._used and identifier(name) == name]
        return self.new(free[0] if free else "i")

    def release(self, name: str) -> None:
        self._used.discard(name)
