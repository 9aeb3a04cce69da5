"""What a problem minimises, and the limits that its results have to keep."""

import dataclasses
import math
import re
from collections.abc import Mapping
from typing import Literal

import numpy as np

from ..._errors import ModelError, ParameterError
from ..._numbers import Numbers
from ..._units.display import Scale, scale_of
from .parse import number_in
from .types import Function

Sense = Literal["<=", ">=", "=="]
_LIMIT = re.compile(r"\s*(<=|>=|==)\s*(.+?)\s*")


@dataclasses.dataclass(frozen=True)
class Objective:
    """What is minimised: a result, and the unit that it is shown in."""

    name: str
    function: Function
    scale: Scale


@dataclasses.dataclass(frozen=True)
class Limit:
    """A limit of a result: in SI units, or whichever the function returns."""

    name: str
    sense: Sense
    value: float
    scale: Scale
    measure: float = 1.0  # what a distance from a limit of zero is compared with

    @property
    def sign(self) -> float:
        """1 where results have to stay below, -1 where above; 1 for an equation."""
        return -1.0 if self.sense == ">=" else 1.0

    @property
    def is_equation(self) -> bool:
        return self.sense == "=="

    @property
    def size(self) -> float:
        """What a distance from the limit is compared with."""
        return abs(self.value) or self.measure

    def excess(self, result: Numbers) -> Numbers:
        """By how much the limit is broken, as a fraction of it; negative inside of it."""
        return self.sign * (result - self.value) / self.size

    def violation(self, result: Numbers) -> Numbers:
        """The excess, zero inside of the limit."""
        excess = self.excess(result)
        return np.abs(excess) if self.is_equation else np.maximum(excess, 0.0)

    @property
    def text(self) -> str:
        return f"{self.sense} {self.scale.value(self.value):.6g}{self.scale.text}"


def objectives_of(minimise: object, name: str = "objective") -> tuple[Objective, ...]:
    """What `minimise` says: a function, a function with the unit to show it in, or a dictionary of these by name.

    A single one is called `name`.
    """
    if isinstance(minimise, Mapping):
        if not minimise:
            raise ModelError("There is nothing to minimise: name at least one function.")
        return tuple(_objective(name, value) for name, value in minimise.items())
    return (_objective(name, minimise),)


def _objective(name: str, value: object) -> Objective:
    function, unit = value if isinstance(value, tuple) and len(value) == 2 else (value, "1")
    if not callable(function) or not isinstance(unit, str):
        raise ModelError(
            f"{name}: state a function, such as lambda s: s.t1, or one with its unit, (lambda s: s.t1, 'ms'); "
            f"got {value!r}."
        )
    return Objective(name, function, scale_of(unit, "", name))


def limits_of(constraints: Mapping[str, object] | None) -> dict[str, tuple[Function, Limit]]:
    """The functions and limits that `constraints` states, as in `{"current": (lambda s: ..., "<= 60 A")}`.

    Raises `ModelError` for what is no such pair, and `ParameterError` for a limit that is no number with a unit.
    """
    if not isinstance(constraints, Mapping | None):
        raise ModelError(
            f"constraints is a dictionary of limits by name, as in {{'time': (lambda s: s.t1, '<= 80 ms')}}; "
            f"got {constraints!r}."
        )
    found = {}
    for name, value in (constraints or {}).items():
        if not (isinstance(value, tuple) and len(value) == 2 and callable(value[0]) and isinstance(value[1], str)):
            raise ModelError(
                f"{name}: a constraint is a function and its limit, as in (lambda s: s.t1, '<= 80 ms'); got {value!r}."
            )
        function, text = value
        parts = _LIMIT.fullmatch(text)
        if parts is None:
            raise ParameterError(f"{name}: {text!r} is no limit, such as '<= 60 A', '>= 1.2' or '== 3 bar'.")
        number, unit = number_in(parts[2], "", name)
        if not math.isfinite(number):
            raise ParameterError(f"{name}: a limit is finite, got {text!r}. Leave out what has none.")
        found[name] = function, Limit(name, _sense(parts[1]), number, scale_of(unit, "", name))
    return found


def _sense(text: str) -> Sense:
    match text:
        case "<=" | ">=" | "==":
            return text
    raise AssertionError(text)
