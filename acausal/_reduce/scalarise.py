"""Scalarisation: equations between arrays as equations between their elements, for models that determine an array in
parts.
"""

import math
from collections.abc import Iterable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._jax_private import ClosedJaxpr, JaxprEqn
from .jaxpr import JOINS, MOVES, bind, called, interpreted, joined, shape_of

ELEMENTWISE = frozenset(
    """
    add add_any sub mul div neg pow integer_pow square sqrt rsqrt cbrt exp exp2 expm1 log log1p log2
    one_minus_square sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh logistic erf abs sign max min
    floor ceil round rem select_n lt le gt ge eq ne and or not convert_element_type is_finite copy
    """.split()
)
INDEXED_MOVES = frozenset(("gather", "dynamic_slice"))


def element_values(closed: ClosedJaxpr, inputs: Sequence[np.ndarray]) -> np.ndarray:
    """The elements of the output of a jaxpr, each computed by scalar operations from the elements it depends on.

    Arrays are NumPy arrays of objects, where an object is a traced scalar. An operation that is not known element by
    element is applied to the whole array, so that its elements depend on all others.
    """
    return _interpret(closed, inputs)[0]


def elements_of(array: Array) -> np.ndarray:
    """A traced array as an array of traced scalars."""
    flat = jnp.reshape(array, (-1,))
    values = [jax.lax.squeeze(jax.lax.slice(flat, (i,), (i + 1,)), (0,)) for i in range(len(flat))]
    return objects(values, jnp.shape(array))


def objects(values: Sequence[object], shape: tuple[int, ...]) -> np.ndarray:
    """An array of objects, without conversion by NumPy."""
    array = np.empty(len(values), dtype=object)
    for i, value in enumerate(values):
        array[i] = value
    return array.reshape(shape)


def _interpret(closed: ClosedJaxpr, inputs: Sequence[np.ndarray]) -> list[np.ndarray]:
    return interpreted(closed, inputs, _apply, np.asarray)


def _apply(eqn: JaxprEqn, args: list[np.ndarray]) -> list[np.ndarray]:
    inner = called(eqn)
    if inner is not None:
        return _interpret(inner, args)
    name = eqn.primitive.name
    symbolic = [arg.dtype == object for arg in args]
    if not any(symbolic):
        with jax.ensure_compile_time_eval():
            return [np.asarray(value) for value in bind(eqn, [jnp.asarray(arg) for arg in args])]
    if name in ELEMENTWISE:
        return [_elementwise(eqn, args)]
    if name in MOVES or (name in INDEXED_MOVES and not any(symbolic[1:])):
        return [moved(eqn, args)]
    if name in JOINS:
        return [joined(eqn, args)]
    if name == "reduce_sum":
        return [_summed(args[0], eqn.params["axes"])]
    if name == "dot_general" and not any(eqn.params["dimension_numbers"][1]):
        return [_dot(*args, *eqn.params["dimension_numbers"][0])]
    return [elements_of(value) for value in bind(eqn, [_whole(arg) for arg in args])]


def _elementwise(eqn: JaxprEqn, args: list[np.ndarray]) -> np.ndarray:
    shape = shape_of(eqn.outvars[0])
    spread = [np.ravel(np.broadcast_to(arg, shape)) for arg in args]
    results = [bind(eqn, [jnp.asarray(arg[i]) for arg in spread])[0] for i in range(math.prod(shape))]
    return objects(results, shape)


def moved(eqn: JaxprEqn, args: list[np.ndarray]) -> np.ndarray:
    """An operation that only moves elements, applied to their indices."""
    numbers = np.arange(args[0].size).reshape(args[0].shape)
    with jax.ensure_compile_time_eval():
        moved = np.asarray(bind(eqn, [jnp.asarray(numbers), *map(jnp.asarray, args[1:])])[0])
    flat = np.ravel(args[0])
    return objects([flat[i] for i in np.ravel(moved)], moved.shape)


def _summed(array: np.ndarray, axes: tuple[int, ...]) -> np.ndarray:
    kept = [axis for axis in range(array.ndim) if axis not in axes]
    shape = tuple(array.shape[axis] for axis in kept)
    rows = array.transpose(*kept, *axes).reshape(math.prod(shape), -1)
    return objects([sum(row[1:], row[0]) for row in rows], shape)


def _dot(a: np.ndarray, b: np.ndarray, axes_a: Iterable[int], axes_b: Iterable[int]) -> np.ndarray:
    products = np.tensordot(a.astype(object), b.astype(object), (tuple(axes_a), tuple(axes_b)))
    return products if isinstance(products, np.ndarray) else objects([products], ())


def _whole(array: np.ndarray) -> Array:
    if array.dtype != object:
        return jnp.asarray(array)
    return jnp.stack([jnp.asarray(value) for value in np.ravel(array)]).reshape(array.shape)
