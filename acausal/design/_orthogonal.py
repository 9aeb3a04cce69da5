"""Least squares as lineax asks for them."""

from typing import Any

import lineax as lx
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from .._linear_solver import least_squares


class Reflections(lx.AbstractLinearSolver[Any]):
    """`least_squares` as a solver of lineax, for one vector.

    Its own `QR` calls LAPACK, which jaxlib cannot always compile in one program with large runs ("no registered
    implementation for untyped custom call").
    """

    def init(self, operator: lx.AbstractLinearOperator, options: dict[str, Any]) -> Float[Array, "m n"]:
        del options
        return operator.as_matrix()

    def compute(
        self, state: Float[Array, "m n"], vector: Any, options: dict[str, Any]
    ) -> tuple[Float[Array, " n"], lx.RESULTS, dict[str, Any]]:
        del options
        x = least_squares(state, ravel_pytree(vector)[0][:, None])[:, 0]
        return x, lx.RESULTS.successful, {}

    def transpose(self, state: Any, options: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
        raise NotImplementedError("Least squares by reflections are not differentiated.")

    def conj(self, state: Any, options: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
        return state.conj(), options

    def assume_full_rank(self) -> bool:
        return True
