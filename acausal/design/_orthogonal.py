"""Linear least squares by Householder reflections, in operations that XLA compiles itself."""

from typing import Any

import jax.numpy as jnp
import lineax as lx
from jax import lax
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float


class Reflections(lx.AbstractLinearSolver[Any]):
    r"""Minimises $|A x - b|$ for one vector `x` and a matrix with full rank and at least as many rows as columns.

    Reflections $I - 2 v v^T / v^T v$ bring `A` to a triangle column by column, as Golub and Van Loan, Matrix
    Computations, section 5.2, do. `lineax.QR` does the same with LAPACK; jaxlib cannot always compile LAPACK's calls
    in one program with large runs ("no registered implementation for untyped custom call").
    """

    def init(self, operator: lx.AbstractLinearOperator, options: dict[str, Any]) -> Float[Array, "m n"]:
        del options
        return operator.as_matrix()

    def compute(
        self, state: Float[Array, "m n"], vector: Any, options: dict[str, Any]
    ) -> tuple[Float[Array, " n"], lx.RESULTS, dict[str, Any]]:
        del options
        n = state.shape[1]
        table = jnp.concatenate([state, ravel_pytree(vector)[0][:, None]], axis=1)
        index = jnp.arange(len(table))

        def reflect(k: Array, table: Array) -> Array:
            below = jnp.where(index >= k, table[:, k], 0.0)
            v = below + jnp.where(index == k, jnp.copysign(jnp.linalg.norm(below), below), 0.0)
            square = v @ v
            return table - jnp.where(square > 0.0, 2.0 / square, 0.0) * v[:, None] * (v @ table)

        table = lax.fori_loop(0, n, reflect, table)

        def substitute(i: Array, x: Array) -> Array:
            k = n - 1 - i
            return x.at[k].set((table[k, n] - table[k, :n] @ x) / table[k, k])

        x = lax.fori_loop(0, n, substitute, jnp.zeros(n, state.dtype))
        return x, lx.RESULTS.successful, {}

    def transpose(self, state: Any, options: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
        raise NotImplementedError("Least squares by reflections are not differentiated.")

    def conj(self, state: Any, options: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
        return state.conj(), options

    def assume_full_rank(self) -> bool:
        return True
