"""Linear complementarity problems with positive semidefinite matrices, for impulses at contacts."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Bool, Float

ROUNDING = 1e-11  # violation of an inequality, relative to the size of its terms, that counts as zero


class _Round(NamedTuple):
    """State of the active-set method; `x` solves the equations of the active set if `is_solved`."""

    x: Array
    active: Array
    is_solved: Array
    goes_on: Array
    rounds: Array


def solve_complementarity(
    matrix: Float[Array, "n n"], start: Float[Array, " n"], least: Float[Array, " n"], takes_part: Bool[Array, " n"]
) -> Float[Array, " n"]:
    """The x >= 0 with u = start + matrix x >= least and x (u - least) = 0 for the elements that take part, and x = 0
    for the others. NaN if there is none.

    x minimises x^T matrix x / 2 + x^T (start - least). The active-set method of Lawson and Hanson (`Solving Least
    Squares Problems`, 1974, ch. 23) finds the elements that are not zero; of elements whose rows depend on each other,
    it activates only some. Derivatives are those for a fixed active set.
    """
    diagonal = jnp.diagonal(matrix)
    moves = takes_part & (diagonal > 0.0)
    scale = jnp.where(moves, 1.0 / jnp.sqrt(jnp.where(moves, diagonal, 1.0)), 0.0)
    matrix, offset = scale[:, None] * matrix * scale, scale * (start - least)
    size = scale * (jnp.abs(start) + jnp.abs(least))
    active, is_found = _active(*jax.lax.stop_gradient((matrix, offset, size)))
    return jnp.where(is_found, scale * _solved(matrix, offset, active), jnp.nan)


def _solved(matrix: Array, offset: Array, active: Array) -> Array:
    """The solution of the equations of the active set; zero for all other elements."""
    own = jnp.where(active[:, None] & active, matrix, jnp.eye(len(offset)))
    return jnp.linalg.solve(own, jnp.where(active, -offset, 0.0))


def _active(matrix: Array, offset: Array, size: Array) -> tuple[Array, Array]:
    """The active set, and whether it is found. The diagonal of the matrix is 1, or 0 for elements that stay zero."""
    n = len(offset)

    def next_round(r: _Round) -> _Round:
        x, active = r.x, r.active
        u = offset + matrix @ x
        violation = jnp.where(active, 0.0, -u - ROUNDING * (size + jnp.abs(matrix) @ jnp.abs(x)))
        enters = r.is_solved & (jnp.arange(n) == jnp.argmax(violation))
        goes_on = ~r.is_solved | (jnp.max(violation) > 0.0)
        active = active | enters
        aim = _solved(matrix, offset, active)
        leaves = active & (aim <= 0.0)
        # The step towards the solution ends where the first element becomes zero, which leaves the active set.
        shares = jnp.where(leaves, x / jnp.where(leaves, x - aim, 1.0), 1.0)
        is_first = leaves & (shares <= jnp.min(shares))
        moved = jnp.where(is_first, 0.0, x + jnp.min(shares) * (aim - x))
        new = _Round(moved, active & ~is_first, ~jnp.any(leaves), goes_on, r.rounds + 1)
        return jax.tree.map(lambda a, b: jnp.where(goes_on, a, b), new, r._replace(goes_on=goes_on))

    start = _Round(jnp.zeros(n), jnp.zeros(n, bool), jnp.asarray(True), jnp.asarray(True), jnp.asarray(0))
    end = jax.lax.while_loop(lambda r: r.goes_on & (r.rounds < 10 + 8 * n), next_round, start)
    return end.active, ~end.goes_on
