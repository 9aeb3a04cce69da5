"""Conditions as relations and their logic. The event indicator of a relation is positive if it is true."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._jax_private import ClosedJaxpr, JaxprEqn
from .jaxpr import bind, called, interpreted, is_floating
from .logic import Expression, both, choice, differ, either, folded, mapped, negation

TINY = float(np.finfo(float).tiny)  # in place of zero; its sign is the truth of a relation between equal numbers
_Known: TypeAlias = tuple[Array, np.ndarray | None]  # a value, and the expressions of its elements, if any


_OF_EQUALS = {"gt": -1, "ge": 1, "lt": -1, "le": 1}  # signs of the event indicators for equal sides


_LOGIC: dict[str, Callable[..., Expression]] = {
    "and": both,
    "or": either,
    "not": negation,
    "xor": differ,
    "ne": differ,
    "eq": lambda a, b: negation(differ(a, b)),
    "select_n": choice,
}
_FOLDED: dict[str, Callable[..., Expression]] = {"reduce_and": both, "reduce_or": either}
_MOVED = ("copy", "squeeze", "reshape", "broadcast_in_dim", "slice", "transpose")


class Relations(NamedTuple):
    """Relations, as arrays of `indicators` and of `sizes`, the magnitudes of the terms of each difference. `of_equals`
    is the sign of each indicator for equal sides, or 0 if there are no sides.
    """

    indicators: list[Array]
    sizes: list[Array]
    of_equals: list[int]


def relations(closed: ClosedJaxpr, inputs: Sequence[Array]) -> tuple[Relations, list[np.ndarray]]:
    """The relations in the outputs of a jaxpr, and for each output an array of expressions in the elements of the
    event indicators, which are numbered consecutively.

    The event indicator of a relation is the difference of its sides; for equal sides, it is a tiny number with the sign
    of the truth value. Any other truth value, such as a comparison of modes, has the event indicator 1 or -1. A real
    output is its own event indicator.
    """
    found = Relations([], [], [])
    outputs = _walk(closed, [(value, None) for value in inputs], found)
    return found, [_expressions(value, logic, found) for value, logic in outputs]


def _walk(closed: ClosedJaxpr, inputs: Sequence[_Known], relations: Relations) -> list[_Known]:
    """The values of the outputs with their expressions."""

    def outputs(eqn: JaxprEqn, args: list[_Known]) -> list[_Known]:
        inner = called(eqn)
        if inner is not None:
            return _walk(inner, args, relations)
        first, *others = bind(eqn, [value for value, _ in args])
        return [(first, _logic(eqn, args, relations)), *((other, None) for other in others)]

    return interpreted(closed, inputs, outputs, lambda value: (jnp.asarray(value), None))


def _logic(eqn: JaxprEqn, args: Sequence[_Known], relations: Relations) -> np.ndarray | None:
    name = eqn.primitive.name
    if name in _OF_EQUALS and is_floating(eqn.invars[0]):
        a, b = (value for value, _ in args)
        # The indicator has its derivative even if it is zero.
        indicator = (a - b if name in ("gt", "ge") else b - a) + jnp.where(a == b, _OF_EQUALS[name] * TINY, 0.0)
        return _relation(indicator, jnp.abs(a) + jnp.abs(b), _OF_EQUALS[name], relations)
    if any(value.dtype != bool for value, _ in args) or all(found is None for _, found in args):
        return None
    if name in _LOGIC:
        return mapped(_LOGIC[name], *(_expressions(value, found, relations) for value, found in args))
    found = args[0][1]
    if name in _FOLDED and found is not None:
        return folded(_FOLDED[name], found, eqn.params["axes"])
    if name in _MOVED and found is not None:
        with jax.ensure_compile_time_eval():
            places = bind(eqn, [jnp.arange(found.size).reshape(found.shape)])[0]
        elements: Any = found.ravel()
        return mapped(lambda place: elements[place], np.asarray(places))
    return None


def _expressions(value: Array, found: np.ndarray | None, relations: Relations) -> np.ndarray:
    if found is not None:
        return found
    indicator = jnp.where(value, 1.0, -1.0) if value.dtype == bool else value
    return _relation(indicator, jnp.abs(indicator), 0, relations)


def _relation(indicator: Array, size: Array, of_equals: int, relations: Relations) -> np.ndarray:
    first, shape = sum(np.size(earlier) for earlier in relations.indicators), np.shape(indicator)
    relations.indicators.append(indicator)
    relations.sizes.append(jnp.broadcast_to(size, shape))
    relations.of_equals.extend([of_equals] * int(np.size(indicator)))
    return mapped(lambda number: ("holds", first + int(number)), np.arange(np.size(indicator)).reshape(shape))
