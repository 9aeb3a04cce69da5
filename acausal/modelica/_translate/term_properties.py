"""Properties of terms."""

from typing import Any

from .._syntax import expressions as e
from .._syntax.visits import parts_of
from .operators import RELATIONS
from .terms import SlotValue


def reads_rates(x: Any) -> bool:
    """Whether an expression reads a derivative."""
    if isinstance(x, e.Builtin) and x.name == "Der":
        return True
    return any(reads_rates(part) for part in parts_of(x))


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
