"""Variables that equations of a flat model make equal up to their sign, or zero."""

from collections.abc import Iterable, Mapping
from typing import Any

from .._syntax import expressions as e
from .._syntax.flat import FlatEquation, FlatVariable

_SIGNS = {"Add": 1, "AddElem": 1, "Plus": 1, "Sub": -1, "SubElem": -1, "Minus": -1}
ZERO = e.Const(0)


class EqualNames:
    """Classes of equal names, from the equations that are a sum of at most two of them."""

    def __init__(self, equations: Iterable[FlatEquation], variables: Mapping[str, FlatVariable]) -> None:
        self._above: dict[Any, tuple[Any, int]] = {}
        sums = [terms for equation in equations if (terms := terms_of(equation.residual)) is not None]
        for variable in variables.values():
            if variable.binding is not None and variable.variability not in ("parameter", "constant"):
                terms = terms_of(e.Binary("Sub", e.Ref(variable.name), variable.binding))
                sums += [] if terms is None else [terms]
        self._merge(sums)

    def of(self, x: Any) -> tuple[Any, int]:
        """The name that stands for the class of a name, or the expression itself, and the sign; `ZERO` for zeros."""
        if isinstance(x, e.Unary) and x.op in _SIGNS:
            root, sign = self.of(x.arg)
            return root, sign * _SIGNS[x.op]
        if isinstance(x, e.Const) and x.value == 0:
            return ZERO, 1
        sign = 1
        while x in self._above:
            x, own = self._above[x]
            sign *= own
        return x, sign

    def sum_of(self, x: Any) -> dict[Any, int]:
        """The names that stand for those of a sum, with their factors; empty for other expressions."""
        return self._collected(terms_of(x) or [])

    def _collected(self, terms: list[tuple[Any, int]]) -> dict[Any, int]:
        found: dict[Any, int] = {}
        for name, sign in terms:
            root, own = self.of(name)
            found[root] = found.get(root, 0) + sign * own
        return {name: count for name, count in found.items() if count and name != ZERO}

    def _merge(self, sums: list[list[tuple[Any, int]]]) -> None:
        """Merges until nothing new follows: a sum of three becomes one of two once a term of it is zero."""
        while True:
            waiting = []
            for terms in sums:
                rest = list(self._collected(terms).items())
                if len(rest) > 2 or (len(rest) == 2 and any(abs(count) != 1 for _, count in rest)):
                    waiting.append(terms)
                elif len(rest) == 2:
                    (first, a), (second, b) = rest
                    self._above[second] = (first, -a * b)
                elif rest:
                    self._above[rest[0][0]] = (ZERO, 1)
            if len(waiting) == len(sums):
                return
            sums = waiting


def terms_of(x: Any) -> list[tuple[Any, int]] | None:
    """The names of a sum and their signs; None for other expressions."""
    match x:
        case e.Ref():
            return [(x, 1)]
        case e.Const() if x.value == 0 and not isinstance(x.value, bool):
            return []
        case e.Unary() if x.op in _SIGNS:
            terms = terms_of(x.arg)
            return None if terms is None else [(name, sign * _SIGNS[x.op]) for name, sign in terms]
        case e.Binary() if x.op in _SIGNS:
            left, right = terms_of(x.left), terms_of(x.right)
            if left is None or right is None:
                return None
            return [*left, *((name, sign * _SIGNS[x.op]) for name, sign in right)]
    return None
