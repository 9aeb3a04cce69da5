"""The elements of the inputs of a jaxpr on which each element of its outputs depends."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
import scipy  # imports its parts on use

from .._jax_private import ClosedJaxpr, JaxprEqn
from .._sparse_matrix import Structure
from .jaxpr import MOVES, bind, called, differentiable_call, interpreted, shape_of
from .scalarise import ELEMENTWISE, INDEXED_MOVES

_JOINS = frozenset(("concatenate", "stack", "pad"))


class Elements(NamedTuple):
    """An array whose elements depend on inputs: a row for each element, a column for each element of the inputs."""

    rows: Any
    shape: tuple[int, ...]


_Value: TypeAlias = Elements | np.ndarray  # a known array depends on nothing


def element_dependence(closed: ClosedJaxpr, is_input: Sequence[bool]) -> list[Structure]:
    """For each output, a row for each of its elements and a column for each element of the inputs that count.

    An element of an output of an unknown operation depends on all its arguments.
    """
    shapes = [tuple(aval.shape) for aval in closed.in_avals]
    sizes = [math.prod(shape) * counts for shape, counts in zip(shapes, is_input, strict=True)]
    n = sum(sizes)
    unit, starts = scipy.sparse.csr_array(scipy.sparse.eye_array(n, dtype=np.int32)), np.cumsum([0, *sizes])
    inputs = [
        Elements(unit[start : start + size] if size else _nothing(math.prod(shape), n), shape)
        for shape, size, start in zip(shapes, sizes, starts[:-1], strict=True)
    ]
    return [_rows(value, n) for value in _interpret(closed, inputs, n)]


def _nothing(size: int, n: int) -> Structure:
    return scipy.sparse.csr_array((size, n), dtype=np.int32)


def _rows(value: _Value, n: int) -> Structure:
    return value.rows if isinstance(value, Elements) else _nothing(np.size(value), n)


def _interpret(closed: ClosedJaxpr, inputs: Sequence[_Value], n: int) -> list[_Value]:
    return interpreted(closed, inputs, lambda eqn, args: _apply(eqn, args, n), np.asarray)


def _apply(eqn: JaxprEqn, args: list[_Value], n: int) -> Sequence[_Value]:
    inner = called(eqn) or differentiable_call(eqn)
    if inner is not None:
        return _interpret(inner, args, n)
    if not any(isinstance(arg, Elements) for arg in args):
        with jax.ensure_compile_time_eval():
            return [np.asarray(value) for value in bind(eqn, [jnp.asarray(arg) for arg in args])]
    name = eqn.primitive.name
    if name in ELEMENTWISE:
        shape = shape_of(eqn.outvars[0])
        numbers = [np.broadcast_to(_numbered(arg.shape), shape).ravel() for arg in args]
        return [Elements(_union([_rows(arg, n)[i] for arg, i in zip(args, numbers, strict=True)]), shape)]
    is_index_known = not any(isinstance(arg, Elements) for arg in args[1:])
    if name in MOVES or name in _JOINS or (name in INDEXED_MOVES and is_index_known):
        return [_moved(eqn, args, n)]
    every = _union([scipy.sparse.csr_array(_rows(arg, n).sum(axis=0)[None]) for arg in args])
    return [Elements(every[np.zeros(math.prod(shape_of(var)), int)], shape_of(var)) for var in eqn.outvars]


def _numbered(shape: tuple[int, ...], first: int = 0) -> np.ndarray:
    """An array of consecutive numbers."""
    return first + np.arange(math.prod(shape)).reshape(shape)


def _union(parts: Sequence[Structure]) -> Structure:
    total = scipy.sparse.csr_array(sum(parts[1:], parts[0]))
    total.eliminate_zeros()
    total.data[:] = 1
    return total


def _moved(eqn: JaxprEqn, args: list[_Value], n: int) -> Elements:
    """An operation that only moves elements, applied to their indices."""
    operands = args if eqn.primitive.name in _JOINS else args[:1]
    starts = np.cumsum([0, *(math.prod(arg.shape) for arg in operands)])
    numbers = [_numbered(arg.shape, start) for arg, start in zip(operands, starts, strict=False)]
    with jax.ensure_compile_time_eval():
        given = [jnp.asarray(value) for value in (*numbers, *args[len(operands) :])]
        moved = np.asarray(bind(eqn, given)[0])
    source = scipy.sparse.csr_array(scipy.sparse.vstack([_rows(arg, n) for arg in operands]))
    is_there = (moved >= 0) & (moved < starts[-1])  # a gather fills places outside of its operand
    rows = source[np.where(is_there, moved, 0).ravel()]
    if not is_there.all():
        rows = scipy.sparse.csr_array(rows.multiply(is_there.reshape(-1, 1)))
        rows.eliminate_zeros()
    return Elements(rows, moved.shape)
