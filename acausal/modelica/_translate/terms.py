"""Terms of translated equations: expressions whose names are resolved to slots, and their properties."""

import dataclasses
from typing import Any

import numpy as np

from .._syntax import expressions as e
from .._syntax.expressions import Expression
from .._syntax.visits import nodes, parts_of
from .operators import RELATIONS
from .values import Value


@dataclasses.dataclass(frozen=True, slots=True)
class SlotValue:
    """The value of a leaf. `kind`: "real", "integer" or "boolean"; `is_discrete` if only events change it."""

    number: int
    kind: str = "real"
    is_discrete: bool = False


@dataclasses.dataclass(frozen=True, slots=True)
class RecordOf:
    """A record, by field."""

    fields: tuple[tuple[str, Expression], ...]


@dataclasses.dataclass(frozen=True, slots=True)
class Opaque:
    """A value that is no literal, such as an array of strings or a table; `key` identifies it."""

    key: str
    value: object = dataclasses.field(compare=False)


def zeros(dims: tuple[int, ...]) -> e.Expression:
    """Zeros of a shape."""
    return e.Builtin("Zeros", tuple(map(e.Const, dims))) if dims else e.Const(0.0)


def constant(value: Value, key: str) -> Any:
    """A known value as a term."""
    if isinstance(value, bool | int | float | str):
        return e.Const(value)
    if isinstance(value, np.ndarray):
        return Opaque(f"{value.dtype}{value.tolist()}", value)
    if isinstance(value, dict):
        return RecordOf(tuple((name, constant(item, f"{key}.{name}")) for name, item in value.items()))
    return Opaque(f"{key} {value!r}", value)


def reads_rates(x: Any) -> bool:
    """Whether an expression reads a derivative."""
    return any(isinstance(one, e.Builtin) and one.name == "Der" for one in nodes(x))


def only_discrete(x: Any) -> bool:
    """Whether an expression changes at events only."""
    if isinstance(x, SlotValue):
        return x.is_discrete
    if isinstance(x, e.Binary) and x.op in RELATIONS:
        return True
    return all(only_discrete(part) for part in parts_of(x))


def is_harmless(x: Any) -> bool:
    """Whether an expression and its derivatives are finite wherever its parts are."""
    if isinstance(x, e.Binary) and x.op not in ("Add", "Sub", "Mul", "AddElem", "SubElem", "MulElem"):
        return False
    if isinstance(x, e.FunctionCall | e.Builtin | e.If | e.Comprehension):
        return False
    return all(is_harmless(part) for part in parts_of(x))
