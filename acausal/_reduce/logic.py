"""Conditions as logical expressions of relations, and their evaluation by one circuit on arrays."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import jax.numpy as jnp
import numpy as np
from jax import Array

from .._indices import unsigned

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
