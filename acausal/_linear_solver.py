"""Repeated solves with one dense matrix: inverted once where it is small, LU-factorised where it is large."""

from collections.abc import Callable

import jax.numpy as jnp
import jax.scipy.linalg as jsl
import numpy as np
from jax import lax
from jaxtyping import Array, Float

LARGEST_INVERSE = 24  # from here on LAPACK's factorisation and eight solves take less time than the inverse

_Vector = Float[Array, " n"]
_Matrix = Float[Array, "n n"]
_Solve = Callable[[_Vector], _Vector]


def gauss_jordan_inverse(matrix: _Matrix) -> _Matrix:
    """Inverse by elimination in place with partial pivoting; not finite where the matrix is singular.

    Rows are never exchanged (`pivot_of[i]` is the column that row `i` eliminated, n before), so that a sweep is
    elementwise: for small matrices XLA on CPU runs this faster than its calls to LAPACK. Indices cannot be negative,
    so that looking them up needs no operation that asks.
    """
    n = len(matrix)
    index = jnp.arange(n, dtype=np.uint32)

    def eliminate(k, carry):
        a, pivot_of = carry
        column = lax.dynamic_index_in_dim(a, k, 1, keepdims=False)
        p = lax.argmax(jnp.where(pivot_of == n, jnp.abs(column), -1.0), 0, np.uint32)
        is_k, is_p = index == k, index == p
        row = lax.dynamic_index_in_dim(a, p, keepdims=False)
        row = jnp.where(is_k, 1.0, row) / lax.dynamic_index_in_dim(row, k, keepdims=False)
        a = jnp.where(is_k, 0.0, a) - column[:, None] * row
        return jnp.where(is_p[:, None], row, a), jnp.where(is_p, k, pivot_of)

    a, pivot_of = lax.fori_loop(np.uint32(0), np.uint32(n), eliminate, (matrix, jnp.full_like(index, n)))
    row_of = jnp.sum(jnp.where(pivot_of[:, None] == index, index[:, None], 0), axis=0, dtype=np.uint32)
    return a[row_of[:, None], pivot_of]


def _factorised(matrix: _Matrix, is_refined: bool) -> tuple[_Solve, _Solve]:
    """Functions that solve with the matrix and with its transpose."""
    if len(matrix) <= LARGEST_INVERSE:
        inverse = gauss_jordan_inverse(matrix)
        if is_refined:
            return _refined(matrix, inverse), _refined(matrix.T, inverse.T)
        return lambda b: inverse @ b, lambda b: b @ inverse
    factors = jsl.lu_factor(matrix)
    return lambda b: jsl.lu_solve(factors, b), lambda b: jsl.lu_solve(factors, b, trans=1)


def _refined(matrix: _Matrix, inverse: _Matrix) -> _Solve:
    """One step of iterative refinement brings the residual down to what elimination leaves."""

    def solve(b: _Vector) -> _Vector:
        x = inverse @ b
        return x + inverse @ (b - matrix @ x)

    return solve


def linear_solver(matrix: _Matrix, nominal: _Vector | None = None, *, is_refined: bool = False) -> _Solve:
    r"""A function that solves $A x = b$ for many `b`; where `is_refined`, as exactly as elimination does.

    Before pivots are chosen each row is divided by its largest term for an `x` of nominal size, so that neither the
    units of the equations nor those of `x` matter. The derivative is implicit, $A\,\dot x = \dot b - \dot A\,x$.
    """
    terms = jnp.abs(matrix if nominal is None else matrix * nominal)
    scale = lax.stop_gradient(1 / jnp.max(terms, axis=1))
    solve, solve_transposed = _factorised(scale[:, None] * lax.stop_gradient(matrix), is_refined)
    return lambda b: lax.custom_linear_solve(
        lambda x: matrix @ x, b, lambda _, b: solve(scale * b), lambda _, b: scale * solve_transposed(b)
    )
