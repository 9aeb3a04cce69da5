"""Solution of small linear systems within the traced program."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._indices import behind_filler
from .._linear_solver import linear_solver
from .._numbers import Numbers
from .affine import computed, negated, over, plus, times

SMALL = 6  # size up to which linear systems are eliminated symbolically, larger ones by a Jacobian
WRITTEN_OUT = 3  # size of systems up to which operations are on entries: fastest, but about n^3 operations to compile
_Row = list[Any]  # the coefficients of an equation, then its constant; None is a structural zero


def eliminated(matrix: list[list[Any]], constant: list[Any]) -> list[Any]:
    """Solve A x + b = 0 with partial pivoting, element by element of arrays; None is a structural zero."""
    n = len(matrix)
    if n == 1:
        return [0.0 if constant[0] is None else negated(over(constant[0], matrix[0][0]))]
    rows = [[computed(value) for value in (*row, b)] for row, b in zip(matrix, constant, strict=True)]
    if n > WRITTEN_OUT:
        return _solved(rows)
    for k in range(n):
        _bring_pivot(rows, k)
        for other in range(k + 1, n):
            rows[other] = _reduced(rows[other], rows[k], k)
    x: list[Any] = [None] * n
    for k in reversed(range(n)):
        total = rows[k][n]
        for j in range(k + 1, n):
            total = plus(total, _product(rows[k][j], x[j]))
        x[k] = None if total is None else negated(over(total, _pivot(rows[k], k)))
    return [0.0 if value is None else value for value in x]


def _bring_pivot(rows: list[_Row], k: int) -> None:
    """Exchange rows so that row k has the largest coefficient of the k-th unknown."""
    for other in range(k + 1, len(rows)):
        if rows[other][k] is None:
            continue
        if rows[k][k] is None:
            rows[k], rows[other] = rows[other], rows[k]
            continue
        here, there = rows[k][k], rows[other][k]
        if isinstance(here, float) and isinstance(there, float):
            if abs(there) > abs(here):
                rows[k], rows[other] = rows[other], rows[k]
            continue
        swap = jnp.abs(there) > jnp.abs(here)
        pairs = list(zip(rows[k], rows[other], strict=True))
        rows[k] = [_either(swap, b, a) for a, b in pairs]
        rows[other] = [_either(swap, a, b) for a, b in pairs]


def _reduced(row: _Row, pivot: _Row, k: int) -> _Row:
    """A row after elimination of the k-th unknown by its pivot row."""
    if row[k] is None:
        return row
    factor = negated(over(row[k], _pivot(pivot, k)))
    return [None] * (k + 1) + [
        computed(plus(b, _product(factor, a))) for a, b in zip(pivot[k + 1 :], row[k + 1 :], strict=True)
    ]


def _pivot(row: _Row, k: int) -> Numbers:
    return 0.0 if row[k] is None else row[k]


def _product(a: Numbers, b: Numbers) -> Any:
    return None if a is None or b is None else times(a, b)


def _either(which: Array, a: Array, b: Numbers) -> Array:
    """One of two coefficients; no operation if they are identical."""
    if a is b:
        return a
    shape = jnp.broadcast_shapes(*(jnp.shape(x) for x in (which, a, b) if x is not None))
    first, second = (jnp.broadcast_to(jnp.asarray(0.0 if x is None else x, float), shape) for x in (a, b))
    return jax.lax.select(jnp.broadcast_to(which, shape), first, second)


def _solved(rows: list[_Row]) -> list[Any]:
    """The solution by operations on arrays, which are fewer."""
    n = len(rows)
    shape = jnp.broadcast_shapes(*(jnp.shape(value) for row in rows for value in row if value is not None))
    # Separate arrays, because jax transposes a solve only if the matrix does not depend on the unknown tangents.
    matrices, constants = stacked([row[:n] for row in rows], shape), stacked([row[n:] for row in rows], shape)
    solve = lambda a, b: linear_solver(a, is_refined=True)(-b[:, 0])  # noqa: E731
    # A batch of one would compile to more operations.
    solutions = solve(matrices[0], constants[0])[None] if len(matrices) == 1 else jax.vmap(solve)(matrices, constants)
    return [solutions[:, i].reshape(shape) for i in range(n)]


def stacked(rows: list[_Row], shape: tuple[int, ...] = ()) -> Array:
    """Coefficients of equations for each element of arrays, [elements, rows, columns]."""
    values = [value for row in rows for value in row if value is not None]
    shape = jnp.broadcast_shapes(shape, *(jnp.shape(value) for value in values))
    flat = [jnp.broadcast_to(jnp.asarray(value, float), shape).ravel() for value in (0.0, *values)]
    is_own = np.array([[value is not None for value in row] for row in rows])
    return jnp.stack(flat, axis=-1)[:, behind_filler(is_own)]
