"""Values of `pre(x)` at the start, from initial equations such as pre(x) = y > 0.

During initialisation, the value takes the place of `pre(x)` wherever it is read. A constant is a start value instead.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

from .._syntax import expressions as e
from .._syntax.flat import Algorithm, FlatEquation
from .._syntax.visits import mapped

_INITIAL = e.Builtin("Initial", ())


def previous_at_start(x: Any) -> tuple[e.Ref, Any] | None:
    """The variable x and the value of an initial equation pre(x) = value. None for other equations."""
    if not isinstance(x, e.Binary) or x.op != "Sub":
        return None
    for left, value in ((x.left, x.right), (x.right, x.left)):
        if isinstance(left, e.Builtin) and left.name == "Pre" and not isinstance(value, e.Const):
            ref = left.args[0]
            if isinstance(ref, e.Ref) and all(isinstance(sub, e.Const) for sub in ref.subs):
                return ref, value
    return None


@dataclasses.dataclass(frozen=True)
class PreviousAtStart:
    """The values of `pre` at the start, and the initial equations that state no such values."""

    values: dict[e.Ref, Any]
    others: list[FlatEquation]

    @classmethod
    def of(cls, initial_equations: Sequence[FlatEquation]) -> "PreviousAtStart":
        values: dict[e.Ref, Any] = {}
        others = []
        for equation in initial_equations:
            found = previous_at_start(equation.residual)
            if found is None or found[0] in values:
                others.append(equation)
            else:
                values[found[0]] = found[1]
        return cls(values, others)

    def equations(self, equations: list[FlatEquation]) -> list[FlatEquation]:
        if not self.values:
            return equations
        return [dataclasses.replace(q, residual=self._in(q.residual)) for q in equations]

    def algorithms(self, algorithms: list[Algorithm]) -> list[Algorithm]:
        if not self.values:
            return algorithms
        return [dataclasses.replace(a, body=self._in(a.body)) for a in algorithms]

    def _in(self, x: Any) -> Any:
        match x:
            case e.Builtin("Pre", (e.Ref() as ref,)) if ref in self.values:
                # Relations in the value are those at the start and cause no events.
                value = e.Builtin("NoEvent", (self.values[ref],))
                return e.If(((_INITIAL, value),), x)
        return mapped(x, self._in)
