"""The solution of small linear systems in the traced program."""

from typing import Any

import jax.numpy as jnp

from .affine import computed, negated, over

UNROLLED = 6  # linear systems up to this size are eliminated in the traced program, larger ones by LAPACK


def eliminated(matrix: list[list[Any]], constant: list[Any]) -> list[Any]:
    """Solve A x + b = 0, entry by entry, with partial pivoting; None stands for a structural zero."""
    n = len(matrix)
    if n == 1:
        return [0.0 if constant[0] is None else negated(over(constant[0], matrix[0][0]))]
    rows = [
        [0.0 if value is None else computed(value) for value in (*row, b)]
        for row, b in zip(matrix, constant, strict=True)
    ]
    for k in range(n):
        for other in range(k + 1, n):
            swap = jnp.abs(rows[other][k]) > jnp.abs(rows[k][k])
            above = [jnp.where(swap, b, a) for a, b in zip(rows[k], rows[other], strict=True)]
            rows[other] = [jnp.where(swap, a, b) for a, b in zip(rows[k], rows[other], strict=True)]
            rows[k] = above
        for other in range(k + 1, n):
            factor = rows[other][k] / rows[k][k]
            rows[other] = [b - factor * a for a, b in zip(rows[k], rows[other], strict=True)]
    x: list[Any] = [0.0] * n
    for k in reversed(range(n)):
        x[k] = -(rows[k][n] + sum(rows[k][j] * x[j] for j in range(k + 1, n))) / rows[k][k]
    return x
