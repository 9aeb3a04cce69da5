"""Values of discrete variables before the start, from initial equations.

An initial equation may state the value of a variable that others determine, such as `active = true` of a step whose
equations are `active = localActive` and `localActive = pre(newActive)`. The value then follows the equations backwards
to the variables whose `pre` is free at the start.
"""

import dataclasses
from collections.abc import Mapping
from typing import Any

from .._syntax import expressions as e
from .._syntax.flat import FlatEquation, FlatVariable, sides


def with_starts(
    variables: Mapping[str, FlatVariable], initial: Mapping[str, Any], equations: list[FlatEquation]
) -> dict[str, FlatVariable]:
    """The variables, with start values of those that are discrete and follow from constants in initial equations."""
    values = {name: x for name, x in initial.items() if isinstance(x, e.Const) and name in variables}
    pairs = [pair for equation in equations if (pair := _pair(equation.residual)) is not None]
    while True:
        new = {}
        for a, b in pairs:
            for known, other in ((a, b), (b, a)):
                if known in values and other not in values:
                    new[other] = values[known]
        if not new:
            break
        values.update(new)
    changed = {n: dataclasses.replace(variables[n], start=x) for n, x in values.items() if variables[n].type != "Real"}
    return {**variables, **changed}


def _pair(x: Any) -> tuple[str, str] | None:
    """The two variables that an equation makes equal, or of which one is equal to `pre` of the other."""
    pairs = ((_name(left), _name(right)) for left, right in sides(x))
    return next((pair for pair in pairs if all(pair)), None)


def _name(x: Any) -> str:
    if isinstance(x, e.Builtin) and x.name == "Pre":
        x = x.args[0]
    return x.name if isinstance(x, e.Ref) and not x.subs else ""
