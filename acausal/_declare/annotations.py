"""Annotations that declare the leaves of a model: `Param`, `Var`, `Flow`, `Time` and `Discrete`.

`Param[Scalar, "N.m/A", positive]` reads: a parameter, a scalar, in newton metre per ampere, that must be positive.
To a type checker it is `Annotated[Scalar, ...]`, so a component's constructor and attributes are checked as usual.
"""

import dataclasses
import functools as ft
import math
import operator
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

import numpy as np
from jax import Array

from .._errors import ArgumentError
from .._numbers import Numbers, Truth
from .._numbers import Scalar as Scalar

Vector: TypeAlias = Array | Any  # an array, made from anything that a constructor accepts: a list, a NumPy array

Role = Literal["param", "var", "flow", "time", "discrete"]


@dataclasses.dataclass(frozen=True)
class Sign:
    """The admissible range of a parameter or a variable."""

    name: Literal["positive", "nonnegative", "nonzero"]
    outside: str = ""  # alternative for values outside the range

    def otherwise(self, outside: str) -> "Sign":
        """This range with an alternative, which the error message names, for values outside it."""
        return dataclasses.replace(self, outside=outside)

    def admits(self, value: Numbers) -> Truth:
        """Whether each element of `value` lies in the range; NaN does not."""
        match self.name:
            case "positive":
                return value > 0
            case "nonnegative":
                return value >= 0
            case "nonzero":
                return (value < 0) | (value > 0)


positive = Sign("positive")
nonnegative = Sign("nonnegative")
nonzero = Sign("nonzero")


@dataclasses.dataclass(frozen=True)
class Limits:
    """The least and greatest value of a parameter, and the place that states them, for messages."""

    low: float = -math.inf
    high: float = math.inf
    place: str = ""

    def admits(self, value: Numbers) -> Truth:
        """Whether each element of `value` lies between the limits; NaN does not."""
        return (value >= self.low) & (value <= self.high)

    @property
    def name(self) -> str:
        if self.high == math.inf:
            return f"at least {self.low:g}"
        return f"at most {self.high:g}" if self.low == -math.inf else f"between {self.low:g} and {self.high:g}"


@dataclasses.dataclass(frozen=True)
class Unbounded:
    """Marks a parameter that may be infinite."""


unbounded = Unbounded()


@dataclasses.dataclass(frozen=True)
class Select:
    """Preference of a variable as a state: higher is preferred."""

    name: str
    rank: int


prefer = Select("prefer", 1)
avoid = Select("avoid", -1)
never = Select("never", -2)


@dataclasses.dataclass(frozen=True)
class Nominal:
    """Nominal size of a variable, which scales error tolerances and pivots. `None`: the default of its unit."""

    value: float


@dataclasses.dataclass(frozen=True)
class Shape:
    """The shape of an array leaf: integers, or names of static fields of the same class that hold integers."""

    sizes: tuple[int | str, ...]


def shape(*sizes: int | str) -> Shape:
    """Declare an array leaf, as in `Var[Vector, "K", shape("n")]` with a static field `n: int`."""
    return Shape(sizes)


def indices(place: Sequence[int], *, counts_from_1: bool) -> str:
    """The indices of an element of an array in names: `[0][1]`, or `[1,2]` in a Modelica model."""
    if counts_from_1 and len(place):
        return f"[{','.join(str(i + 1) for i in place)}]"
    return "".join(f"[{i}]" for i in place)


@dataclasses.dataclass(frozen=True)
class Declaration:
    """Declaration of one leaf in its class.

    `sign` and `limits` are the admissible range of its values, which must be finite unless it `is_unbounded`. `select`,
    `nominal` and `start`, the default start value, apply to variables. `sizes` is empty for a scalar, and None for a
    parameter with the shape of the value that it is given. The given start value of a variable that `is_fixed` is
    always a condition, never only an initial guess. `counts_from_1`: names of elements follow Modelica.
    `title` is the name in printed models, empty for that of the field; None hides it.
    """

    role: Role
    unit: str
    sign: Sign | None = None
    select: int = 0
    nominal: float | None = None
    sizes: tuple[int | str, ...] | None = ()
    start: float | tuple[Any, ...] = 0.0  # of an array, a nested tuple, or one number for all elements
    is_unbounded: bool = False
    is_fixed: bool = False
    limits: Limits | None = None
    counts_from_1: bool = False
    title: str | None = ""

    def element(self, place: Sequence[int]) -> str:
        """The indices of an element in names."""
        return indices(place, counts_from_1=self.counts_from_1)

    @property
    def ranges(self) -> tuple[Sign | Limits, ...]:
        """The stated ranges, all of which hold."""
        return tuple(one for one in (self.sign, self.limits) if one is not None)

    def admits(self, value: Any) -> Any:
        """Whether each element of `value` is admissible; NaN is not."""
        parts = [one.admits(value) for one in self.ranges]
        if not self._may_be_infinite:
            parts.append(abs(value) < math.inf)
        return ft.reduce(operator.and_, parts) if parts else value == value

    @property
    def guess(self) -> float | np.ndarray:
        """The default start value, as a number or an array."""
        return self.start if isinstance(self.start, float) else np.asarray(self.start, float)

    @property
    def range(self) -> str:
        """The condition of `admits`, as it follows "must be"."""
        if not self.ranges:
            return "a number" if self._may_be_infinite else "a finite number"
        said = " and ".join([*(one.name for one in self.ranges), *([] if self._may_be_infinite else ["finite"])])
        if self.limits is not None and self.limits.place:
            return f"{said} ({self.limits.place})"
        return f"{said} (otherwise {self.sign.outside})" if self.sign is not None and self.sign.outside else said

    @property
    def _may_be_infinite(self) -> bool:
        return self.is_unbounded or self.role == "discrete"

    @property
    def is_variable(self) -> bool:
        """Whether equations determine the leaf; a parameter is given, and only events change a discrete variable."""
        return self.role in ("var", "flow", "time")


def _declaration(role: Role, unit: object, options: tuple[object, ...], scalar: bool) -> Declaration:
    if not isinstance(unit, str):
        raise ArgumentError(f"The second item of an annotation is its unit, a string such as 'N.m'; got {unit!r}.")
    fields: dict[str, Any] = {"sizes": () if scalar else None}
    for option in options:
        match option:
            case Sign():
                fields["sign"] = option
            case Unbounded():
                fields["is_unbounded"] = True
            case Select():
                fields["select"] = option.rank
            case Nominal():
                fields["nominal"] = option.value
            case Shape():
                fields["sizes"] = option.sizes
            case _:
                raise ArgumentError(
                    f"Unknown option {option!r} in an annotation. Use positive, nonnegative, nonzero, unbounded, "
                    "prefer, avoid, never, Nominal(...) or shape(...)."
                )
    return Declaration(role, unit, **fields)


class _Maker:
    """`Param[type, unit, *options]` at run time: `Annotated[type, Declaration]`."""

    def __init__(self, role: Role) -> None:
        self._role: Role = role

    @property
    def remedy(self) -> str:
        return f"{self._role.capitalize()}[...] takes a type and a unit, as in Param[Scalar, 'ohm']."

    def __getitem__(self, items: tuple[Any, ...]) -> Any:
        if not isinstance(items, tuple) or len(items) < 2:
            raise ArgumentError(self.remedy)
        kind, unit, *options = items
        return Annotated[kind, _declaration(self._role, unit, tuple(options), kind == Scalar)]


if TYPE_CHECKING:
    from typing import Annotated as Discrete
    from typing import Annotated as Flow
    from typing import Annotated as Param
    from typing import Annotated as Time
    from typing import Annotated as Var
else:
    Param = _Maker("param")
    Var = _Maker("var")
    Flow = _Maker("flow")
    Time = _Maker("time")
    Discrete = _Maker("discrete")


def declared(annotation: object, where: str) -> Declaration | None:
    """The `Declaration` inside an annotation; None for other annotations.

    Raises `ArgumentError` for an annotation of the library without a type and a unit, which would pass for the type of
    a constant.
    """
    if isinstance(annotation, _Maker):
        raise ArgumentError(f"{where} lacks its type and its unit: {annotation.remedy}")
    for item in getattr(annotation, "__metadata__", ()):
        if isinstance(item, Declaration):
            return item
    return None
