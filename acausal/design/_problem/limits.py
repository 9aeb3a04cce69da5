"""Objectives and limits of results."""

import dataclasses
import math
import re
from collections.abc import Mapping
from typing import Literal, cast

import numpy as np

from ..._errors import ModelError, ParameterError
from ..._numbers import Numbers
from ..._units.display import Scale, scale_of
from .types import Function, number_in

Sense = Literal["<=", ">=", "=="]
_LIMIT = re.compile(r"\s*(<=|>=|==)\s*(.+?)\s*")


@dataclasses.dataclass(frozen=True)
class Objective:
    """A result to minimise, with its display unit."""

    name: str
    function: Function
    scale: Scale


@dataclasses.dataclass(frozen=True)
class Limit:
    """A limit of a result, in SI units or in the unit that the function returns."""

    name: str
    sense: Sense
    value: float
    scale: Scale
    measure: float = 1.0  # size of a limit of zero

    @property
    def sign(self) -> float:
        """1 for an upper limit or an equation, -1 for a lower limit."""
        return -1.0 if self.sense == ">=" else 1.0

    @property
    def is_equation(self) -> bool:
        """Whether the result must equal the value of the limit."""
        return self.sense == "=="

    @property
    def size(self) -> float:
        """The size that violations are relative to."""
        return abs(self.value) or self.measure

    def constraint(self, result: Numbers) -> Numbers:
        """Scaled constraint: at most zero if the limit is satisfied, zero for an equation."""
        return self.sign * (result - self.value) / self.size

    def excess(self, result: Numbers) -> Numbers:
        """Violation relative to the size of the limit; negative for an inequality that is satisfied."""
        constraint = self.constraint(result)
        return np.abs(constraint) if self.is_equation else constraint

    @property
    def text(self) -> str:
        """The relation and the value, such as "<= 35 A"."""
        return f"{self.sense} {self.scale.value(self.value):.6g}{self.scale.text}"


def objectives_of(minimise: object, name: str = "objective") -> tuple[Objective, ...]:
    """Objectives from a function, a function with its display unit, or a dictionary of these by name.

    `name` is the name of a single one.
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
            f"{name}: give a function, such as lambda s: s.t1, or one with its unit, (lambda s: s.t1, 'ms'); "
            f"got {value!r}."
        )
    return Objective(name, function, scale_of(unit, "", name))


def limits_of(constraints: Mapping[str, object] | None) -> dict[str, tuple[Function, Limit]]:
    """Functions and limits by name, from a dictionary such as `{"current": (lambda s: ..., "<= 60 A")}`.

    Raises `ModelError` for anything else, and `ParameterError` for a limit that is not a number with a unit.
    """
    if not isinstance(constraints, Mapping | None):
        raise ModelError(
            f"constraints must be a dictionary of limits by name, as in {{'time': (lambda s: s.t1, '<= 80 ms')}}; "
            f"got {constraints!r}."
        )
    found = {}
    for name, value in (constraints or {}).items():
        if not (isinstance(value, tuple) and len(value) == 2 and callable(value[0]) and isinstance(value[1], str)):
            raise ModelError(
                f"{name}: a constraint must be a function and a limit, as in (lambda s: s.t1, '<= 1 s'); got {value!r}."
            )
        function, text = value
        parts = _LIMIT.fullmatch(text)
        if parts is None:
            raise ParameterError(f"{name}: {text!r} is not a limit, such as '<= 60 A', '>= 1.2' or '== 3 bar'.")
        number, unit = number_in(parts[2], "", name)
        if not math.isfinite(number):
            raise ParameterError(f"{name}: a limit must be finite, got {text!r}. Leave out a constraint without one.")
        found[name] = function, Limit(name, cast(Sense, parts[1]), number, scale_of(unit, "", name))
    return found
