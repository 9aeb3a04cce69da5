"""Conditions as relations and their logic; the margin of a relation is a number that is positive where it holds."""

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._jax_private import ClosedJaxpr, JaxprEqn
from .jaxpr import bind, called, interpreted, is_floating
from .logic import Expression, both, choice, differ, either, folded, mapped, negation

LEAST = 1e-300  # in place of zero, whose sign tells whether a relation holds between equal numbers
_Known: TypeAlias = tuple[Array, np.ndarray | None]  # a value, and expressions for its elements, where there are any


def _margin_of(difference: Callable[[Array, Array], Array], of_equals: float) -> Callable[[Array, Array], Array]:
    """The difference, which keeps its derivative where it is zero."""
    return lambda a, b: difference(a, b) + jnp.where(a == b, of_equals, 0.0)


_RELATIONS: dict[str, Callable[[Array, Array], Array]] = {
    "gt": _margin_of(lambda a, b: a - b, -LEAST),
    "ge": _margin_of(lambda a, b: a - b, LEAST),
    "lt": _margin_of(lambda a, b: b - a, -LEAST),
    "le": _margin_of(lambda a, b: b - a, LEAST),
}


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


def relations(closed: ClosedJaxpr, inputs: Sequence[Array]) -> tuple[list[Array], list[np.ndarray]]:
    """The margins of the relations that the outputs of a jaxpr are made of, and for each output an array of expressions
    in the elements of the margins, which are numbered one after the other.

    The margin of a relation is the difference of its sides, where these are equal a tiny number of the right sign. What
    is neither a relation between real numbers nor made of them, such as a comparison of modes, has the margin 1 or -1.
    A real output is its own margin.
    """
    margins: list[Array] = []
    outputs = _walk(closed, [(value, None) for value in inputs], margins)
    return margins, [_expressions(value, found, margins) for value, found in outputs]


def _walk(closed: ClosedJaxpr, inputs: Sequence[_Known], margins: list[Array]) -> list[_Known]:
    """The values of the outputs with their expressions."""

    def outputs(eqn: JaxprEqn, args: list[_Known]) -> list[_Known]:
        inner = called(eqn)
        if inner is not None:
            return _walk(inner, args, margins)
        first, *others = bind(eqn, [value for value, _ in args])
        return [(first, _logic(eqn, args, margins)), *((other, None) for other in others)]

    return interpreted(closed, inputs, outputs, lambda value: (jnp.asarray(value), None))


def _logic(eqn: JaxprEqn, args: Sequence[_Known], margins: list[Array]) -> np.ndarray | None:
    name = eqn.primitive.name
    if name in _RELATIONS and is_floating(eqn.invars[0]):
        return _relation(_RELATIONS[name](*(value for value, _ in args)), margins)
    if any(value.dtype != bool for value, _ in args) or all(found is None for _, found in args):
        return None
    if name in _LOGIC:
        return mapped(_LOGIC[name], *(_expressions(value, found, margins) for value, found in args))
    found = args[0][1]
    if name in _FOLDED and found is not None:
        return folded(_FOLDED[name], found, eqn.params["axes"])
    if name in _MOVED and found is not None:
        with jax.ensure_compile_time_eval():
            places = bind(eqn, [jnp.arange(found.size).reshape(found.shape)])[0]
        elements: Any = found.ravel()
        return mapped(lambda place: elements[place], np.asarray(places))
    return None


def _expressions(value: Array, found: np.ndarray | None, margins: list[Array]) -> np.ndarray:
    if found is not None:
        return found
    return _relation(jnp.where(value, 1.0, -1.0) if value.dtype == bool else value, margins)


def _relation(margin: Array, margins: list[Array]) -> np.ndarray:
    first, shape = sum(np.size(earlier) for earlier in margins), np.shape(margin)
    margins.append(margin)
    return mapped(lambda number: ("holds", first + int(number)), np.arange(np.size(margin)).reshape(shape))
