"""Conditions as logical expressions of relations, and their evaluation by one circuit on arrays.

The event indicator of a relation is positive if the relation is true.
"""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._indices import unsigned
from .._jax_private import ClosedJaxpr, JaxprEqn
from .jaxpr import JOINS, MOVES, bind, called, interpreted, is_floating, joined

# ("holds", k) and ("fails", k) for relation k; ("and", a, b) and ("or", a, b) for expressions.
Expression: TypeAlias = tuple[Any, ...]
NEVER: Expression = ("never",)  # never part of another expression
_OPPOSITE = {"holds": "fails", "fails": "holds", "and": "or", "or": "and"}


def negation(a: Expression) -> Expression:
    name, *parts = a
    return (_OPPOSITE[name], *(part if isinstance(part, int) else negation(part) for part in parts))


def both(a: Expression, b: Expression) -> Expression:
    return a if a == b else ("and", a, b)


def either(a: Expression, b: Expression) -> Expression:
    return a if a == b else ("or", a, b)


def differ(a: Expression, b: Expression) -> Expression:
    return either(both(a, negation(b)), both(negation(a), b))


def choice(which: Expression, if_false: Expression, if_true: Expression) -> Expression:
    return either(both(negation(which), if_false), both(which, if_true))


def literals_of(a: Expression) -> dict[str, frozenset[int]]:
    """The relations that an expression reads as true ("holds"), and those that it reads as false ("fails")."""
    if len(a) == 2:
        return {"holds": frozenset(), "fails": frozenset(), a[0]: frozenset({a[1]})}
    parts = [literals_of(part) for part in a[1:]]
    return {key: frozenset().union(*(part[key] for part in parts)) for key in ("holds", "fails")}


def mapped(function: Callable[..., Expression], *arrays: np.ndarray) -> np.ndarray:
    """An array of expressions from arrays of them, element by element."""
    together = np.broadcast_arrays(*arrays)
    found = np.empty(together[0].shape, object)
    for index in np.ndindex(found.shape):
        found[index] = function(*(array[index] for array in together))
    return found


def folded(function: Callable[..., Expression], array: np.ndarray, axes: Sequence[int]) -> np.ndarray:
    """A reduction of an array of expressions along some axes."""
    for axis in sorted(axes, reverse=True):
        parts = np.moveaxis(array, axis, 0)
        array = parts[0, ...]  # the dots keep an array in the case of a single axis
        for i in range(1, len(parts)):
            array = mapped(function, array, parts[i, ...])
    return array


def sign_of(truths: Array) -> Array:
    """Event indicators of relations whose truths alone are known."""
    return jnp.where(truths, 1.0, -1.0)


def edges(now: Array, before: Array, either: Array | np.ndarray) -> Array:
    """Conditions whose change is an event: those that become true, and those of `either` that become false."""
    return jnp.where(either, now != before, now & ~before)


@dataclasses.dataclass(frozen=True, eq=False)
class Circuit:
    """Logical expressions of relations. `levels` state, for each gate, whether it is an "and" and its inputs; `outputs`
    are the positions of the expressions. The first values are -1 (never true), the relations, and their negations.
    """

    levels: tuple[tuple[np.ndarray, np.ndarray, np.ndarray], ...]
    outputs: np.ndarray

    def __call__(self, holds: Array, fails: Array) -> Array:
        """Event indicators of the expressions from those of the relations and of their negations: the smaller one for
        `and`, the larger one for `or`.
        """
        if not self.levels and np.array_equal(self.outputs, 1 + np.arange(len(holds))):
            return holds
        values = jnp.concatenate([np.array([-1.0]), holds, fails])
        for is_and, first, second in self.levels:
            a, b = values[first], values[second]
            values = jnp.concatenate([values, jnp.where(is_and, jnp.minimum(a, b), jnp.maximum(a, b))])
        return values[self.outputs]

    def hold(self, truths: Array) -> Array:
        """The truths of the expressions for these truths of the relations."""
        sign = sign_of(truths)
        return self(sign, -sign) > 0


def circuit(expressions: Sequence[Expression], n_relations: int) -> Circuit:
    """All expressions as one circuit without duplicate gates."""
    depths: dict[Expression, int] = {}
    for expression in expressions:
        _measure(expression, depths)
    places: dict[Expression, int] = {}
    levels, total = [], 1 + 2 * n_relations

    def place(a: Expression) -> int:
        if len(a) == 3:
            return places[a]
        return 0 if a == NEVER else 1 + a[1] + n_relations * (a[0] == "fails")

    for depth in range(1, max(depths.values(), default=0) + 1):
        gates = [a for a, own in depths.items() if own == depth]
        reads = [[place(part) for part in gate[1:]] for gate in gates]
        first, second = (unsigned(column) for column in zip(*reads, strict=True))
        levels.append((np.array([gate[0] == "and" for gate in gates]), first, second))
        places |= {gate: total + i for i, gate in enumerate(gates)}
        total += len(gates)
    return Circuit(tuple(levels), unsigned([place(a) for a in expressions]))


def _measure(a: Expression, depths: dict[Expression, int]) -> int:
    if len(a) != 3:
        return 0
    if a not in depths:
        depths[a] = 1 + max(_measure(part, depths) for part in a[1:])
    return depths[a]


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
    if name in JOINS:
        return joined(eqn, [_expressions(value, found, relations) for value, found in args])
    found = args[0][1]
    if name in _FOLDED and found is not None:
        return folded(_FOLDED[name], found, eqn.params["axes"])
    if name in MOVES and found is not None:
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
