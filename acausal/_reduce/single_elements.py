"""Elements that are taken from an array of scalars: an equation reads them without the other elements."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._jax_private import ClosedJaxpr, JaxprEqn
from .._tracing import is_traced
from .jaxpr import JOINS, MOVES, bind, interpreted, joined, shape_of, structs
from .scalarise import moved, objects


class _Joined(NamedTuple):
    """An array and its elements."""

    whole: Array
    elements: np.ndarray


def with_single_elements(closed: ClosedJaxpr) -> ClosedJaxpr:
    """The program in which a scalar that is an element of a joined array is read directly."""
    if not any(eqn.primitive.name in JOINS for eqn in closed.jaxpr.eqns):
        return closed

    def program(*inputs: Array) -> list[Array]:
        return [_whole(value) for value in interpreted(closed, inputs, _apply, jnp.asarray)]

    return jax.make_jaxpr(program)(*structs([shape_of(var) for var in closed.jaxpr.invars]))


def _apply(eqn: JaxprEqn, args: Sequence[Any]) -> list[Any]:
    results: list[Any] = list(bind(eqn, [_whole(arg) for arg in args]))
    found = _elements(eqn, args)
    if found is not None:
        results = [found.item() if found.shape == () else _Joined(results[0], found)]
    return results


def _elements(eqn: JaxprEqn, args: Sequence[Any]) -> np.ndarray | None:
    """The elements of the result of an operation that joins scalars, or moves elements of what is joined."""
    name = eqn.primitive.name
    if name in JOINS:
        parts = [_elements_of(arg) for arg in args]
        known = [part for part in parts if part is not None]
        return joined(eqn, known) if len(known) == len(parts) else None
    if name in MOVES and (isinstance(args[0], _Joined) or math.prod(shape_of(eqn.outvars[0])) == 1):
        elements = _elements_of(args[0])
        return None if elements is None else moved(eqn, [elements])
    return None


def _elements_of(value: Any) -> np.ndarray | None:
    if isinstance(value, _Joined):
        return value.elements
    if np.ndim(value) == 0:
        return objects([value], ())
    return None if is_traced(value) else objects([jnp.asarray(x) for x in np.ravel(value)], np.shape(value))


def _whole(value: Any) -> Array:
    return value.whole if isinstance(value, _Joined) else value
