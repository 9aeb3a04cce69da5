"""The operators of the Modelica language, on values (Modelica 3.6, section 10.6)."""

from collections.abc import Callable

import jax.numpy as jnp
import numpy as np

from ..._errors import ModelError
from .scope import NotKnown
from .values import UnknownText, Value, by_field, element_power, is_known, number, plain, power, product


def _quotient(a: Value, b: Value) -> Value:
    if is_known(b) and not np.all(b):
        b = np.asarray(b, float)
        with np.errstate(all="ignore"):
            return plain(a / b)
    return a / b


_NUMERIC: dict[str, Callable[[Value, Value], Value]] = {
    "Add": lambda a, b: a + b,
    "Sub": lambda a, b: a - b,
    "Mul": product,
    "Div": _quotient,
    "Exp": power,
    "AddElem": lambda a, b: a + b,
    "SubElem": lambda a, b: a - b,
    "MulElem": lambda a, b: a * b,
    "DivElem": _quotient,
    "ExpElem": element_power,
}
_ORDERS: dict[str, Callable[[Value, Value], Value]] = {
    "Lt": lambda a, b: a < b,
    "Le": lambda a, b: a <= b,
    "Gt": lambda a, b: a > b,
    "Ge": lambda a, b: a >= b,
}
RELATIONS: dict[str, Callable[[Value, Value], Value]] = {
    **_ORDERS,
    "Eq": lambda a, b: a == b,
    "Neq": lambda a, b: a != b,
}


def arithmetic(op: str, a: Value, b: Value) -> Value:
    """A sum, difference, product, quotient or power."""
    if op not in _NUMERIC:
        raise ModelError(f"the operator {op} is not supported.")
    return _NUMERIC[op](a, b)


def relation(op: str, a: Value, b: Value) -> Value:
    """The truth of a relation. Raises `NotKnown` for texts that depend on variables."""
    if isinstance(a, UnknownText) or isinstance(b, UnknownText):
        raise NotKnown("a text that depends on variables")
    if op in _ORDERS:
        a, b = number(a), number(b)
    return plain(RELATIONS[op](a, b))


def both_or_either(op: str, a: Value, b: Value) -> Value:
    """`and` or `or` of two values, one of which may be known."""
    is_and = op == "And"
    if is_known(a) and is_known(b):
        return plain(np.logical_and(a, b) if is_and else np.logical_or(a, b))
    for known, other in ((a, b), (b, a)):
        if is_known(known) and np.ndim(known) == 0:
            return other if bool(known) == is_and else bool(known)
    return jnp.logical_and(a, b) if is_and else jnp.logical_or(a, b)


def unary(op: str, value: Value) -> Value:
    """`not`, `-` or `+`."""
    if op == "Not":
        return plain(np.logical_not(value)) if is_known(value) else jnp.logical_not(value)
    return by_field(value, lambda x: -number(x) if op in ("Minus", "MinusElem") else number(x))
