"""Dense linear systems: repeated solves with one matrix, by an inverse or by LU factors, and least squares."""

import functools as ft
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import jax.scipy.linalg as jsl
import numpy as np
from jax import lax
from jax.custom_batching import custom_vmap
from jaxtyping import Array, Float

from ._sparse_matrix import SparseFactors, SparseMatrix

LARGEST_INVERSE = 40  # above it, LAPACK is faster, although XLA does not compile a loop with its calls as one function
LARGEST_SUM = 8  # above it, XLA's product of a matrix and a vector is faster than sums that it fuses with what follows

_Vector = Float[Array, " n"]
_Matrix = Float[Array, "n n"]
_Solve = Callable[[_Vector], _Vector]


def gauss_jordan_inverse(matrix: _Matrix) -> _Matrix:
    """Inverse by elimination in place with partial pivoting; not finite for a singular matrix.

    Rows are never exchanged: `pivot_of[i]` is the column that row `i` eliminated, and n before. So a sweep is
    elementwise, and faster for small matrices on the CPU than calls of LAPACK. Indices are unsigned: a lookup compiles
    no test for negative ones.
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


def least_squares(a: Float[Array, "m n"], b: Float[Array, "m k"]) -> Float[Array, "n k"]:
    r"""The least-squares solution x of $A x = b$ for each column of b; A has full rank and at least as many rows as
    columns.

    Householder reflections $I - 2 v v^T / v^T v$ reduce `a` to a triangle column by column (Golub and Van Loan, Matrix
    Computations, section 5.2). XLA does not compile a loop with calls of LAPACK as one function, but does so with these
    operations.
    """
    n = a.shape[1]
    rows, columns = jnp.arange(len(a)), jnp.arange(n)[:, None]

    def reflect(k: Array, table: Array) -> Array:
        below = jnp.where(rows >= k, table[:, k], 0.0)
        v = below + jnp.where(rows == k, jnp.copysign(jnp.sqrt(below @ below), below), 0.0)
        square = v @ v
        return table - jnp.where(square > 0.0, 2.0 / square, 0.0) * v[:, None] * (v @ table)

    table = lax.fori_loop(0, n, reflect, jnp.concatenate([a, b], axis=1))

    def substitute(i: Array, x: Array) -> Array:
        k = n - 1 - i
        return jnp.where(columns == k, (table[k, n:] - table[k, :n] @ x) / table[k, k], x)

    return lax.fori_loop(0, n, substitute, jnp.zeros((n, b.shape[1])))


class Factors(eqx.Module):
    """A factorised matrix with rows multiplied by `scale`: its inverse, or the LU factors and permutation of a large
    one. Solves are not differentiated with respect to it.
    """

    scale: _Vector
    parts: tuple[Array, ...]

    def solve(self, b: _Vector) -> _Vector:
        """The solution for one right-hand side."""
        b = self.scale * b
        if len(self.parts) == 1:
            (inverse,) = self.parts
            return jnp.sum(inverse * b, axis=1) if len(b) <= LARGEST_SUM else inverse @ b
        return jsl.lu_solve(self.parts, b)

    def solve_transposed(self, b: _Vector) -> _Vector:
        """The same with the transposed matrix."""
        x = b @ self.parts[0] if len(self.parts) == 1 else jsl.lu_solve(self.parts, b, trans=1)
        return self.scale * x

    def refined(self, matrix: _Matrix) -> tuple[_Solve, _Solve]:
        """Functions that solve with the matrix and with its transpose, with the accuracy of elimination."""
        if len(self.parts) > 1:
            return self.solve, self.solve_transposed
        return _refined(matrix, self.solve), _refined(matrix.T, self.solve_transposed)


@custom_vmap
def _solution(factors: Factors, b: _Vector) -> _Vector:
    """`Factors.solve`, column by column for a batch. XLA hands the product of a matrix and many vectors to a library,
    and a loop with such a call is not compiled as one function.
    """
    return factors.solve(b)


@_solution.def_vmap
def _solutions(size: int, batched: list[Any], factors: Factors, b: Array) -> tuple[Array, bool]:
    del size
    axes = jax.tree.map(lambda is_batched: 0 if is_batched else None, batched)
    return jax.vmap(_by_columns, in_axes=axes)(factors, b), True


def _by_columns(factors: Factors, b: _Vector) -> _Vector:
    inverse, *others = factors.parts
    if others:
        return factors.solve(b)
    b = factors.scale * b

    def add(k: Array, x: Array) -> Array:
        column, factor = (lax.dynamic_index_in_dim(of, k, -1, keepdims=False) for of in (inverse, b))
        return x + column * factor

    return lax.fori_loop(np.uint32(0), np.uint32(len(b)), add, jnp.zeros_like(b))


def factors_of(
    matrix: _Matrix | SparseMatrix, nominal: _Vector | None = None, *, n_integrals: int = 0
) -> Factors | SparseFactors:
    """The factors of a matrix whose last `n_integrals` columns are zero except on the diagonal.

    Each row of a dense matrix is first divided by its largest term for an `x` of nominal size, so the choice of pivots
    does not depend on the units of the equations and of `x`.
    """
    if isinstance(matrix, SparseMatrix):
        return matrix.factors(nominal)
    terms = jnp.abs(matrix if nominal is None else matrix * nominal)
    scale = lax.stop_gradient(1 / jnp.max(terms, axis=1))
    scaled = scale[:, None] * lax.stop_gradient(matrix)
    n = len(matrix) - n_integrals
    return Factors(scale, (_inverse(scaled, n),) if n <= LARGEST_INVERSE else jsl.lu_factor(scaled))


def _inverse(matrix: _Matrix, n: int) -> _Matrix:
    """The inverse of a matrix whose columns after the first n are zero except on the diagonal."""
    if n == len(matrix):
        return gauss_jordan_inverse(matrix)
    first = gauss_jordan_inverse(matrix[:n, :n]) if n else matrix[:0, :0]
    rest = 1.0 / jnp.diagonal(matrix)[n:]
    above = jnp.pad(first, ((0, 0), (0, len(rest))))
    return jnp.concatenate(
        [above, jnp.concatenate([-rest[:, None] * (matrix[n:, :n] @ first), jnp.diag(rest)], axis=1)]
    )


def _refined(matrix: _Matrix, rough: _Solve) -> _Solve:
    """A solver with one step of iterative refinement, which reduces the residual to that of elimination."""

    def solve(b: _Vector) -> _Vector:
        x = rough(b)
        return x + rough(b - matrix @ x)

    return solve


def linear_solver(
    matrix: _Matrix | SparseMatrix,
    nominal: _Vector | None = None,
    *,
    factors: Factors | SparseFactors | None = None,
    is_refined: bool = False,
) -> _Solve:
    r"""A function that solves $A x = b$ for many `b`; with `is_refined`, with the accuracy of elimination.

    The derivative is implicit, $A\,\dot x = \dot b - \dot A\,x$. The `factors` of the matrix can be given.
    """
    factors = factors or factors_of(matrix, nominal)
    if isinstance(factors, SparseFactors):  # as accurate as elimination
        solve, solve_transposed = factors.substituted, factors.substituted_transposed
    elif is_refined:
        solve, solve_transposed = factors.refined(jnp.asarray(lax.stop_gradient(matrix)))
    else:
        solve, solve_transposed = ft.partial(_solution, factors), factors.solve_transposed
    return lambda b: lax.custom_linear_solve(
        lambda x: matrix @ x, b, lambda _, b: solve(b), lambda _, b: solve_transposed(b)
    )
