"""Blocks of linear equations that determine their unknowns by rounding errors only."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._reduce.incidence import Pair
from .blocks import Known, tear_matrix
from .groups import Store, over_members
from .program import Program
from .starts import Inputs
from .system import System

CHANGE = 1e-6  # relative change of the numbers from which a determinant is computed
GROWTH = 1e7  # a determinant that this change multiplies by more is zero but for rounding


def singular_blocks(system: System, store: Store, inputs: Inputs) -> Array:
    """For each linear block, in the order of `linear_blocks`, whether it is singular but for rounding.

    Where coefficients cancel, as 0.3 - 0.1 * 3.0 does, what is left is an error of rounding and no NaN tells. But the
    determinant then is far smaller than it becomes when the numbers that it is computed from are changed a little.
    """
    parts: list[Array] = [jnp.zeros(0, bool)]
    for group in system.plan.groups:
        if group.program.method == "linear":
            parts.append(
                over_members(group, store, inputs.params, lambda known, _, g=group: _singular(g.program, known), [])
            )
    return jnp.concatenate(parts)


def linear_blocks(system: System) -> list[Pair]:
    """The first unknown of each linear block."""
    groups = [group for group in system.plan.groups if group.program.method == "linear"]
    return [use.gives[0] for group in groups for use in group.uses]


def _singular(program: Program, known: Known) -> Array:
    def matrix(change: Array) -> Array:
        """With all numbers changed by shares that differ, so that the changes do not cancel between coefficients."""
        leaves, structure = jax.tree_util.tree_flatten((known.params, known.values))
        changed = [x + change * x * np.cos(1.0 + i + np.arange(x.size)).reshape(x.shape) for i, x in enumerate(leaves)]
        params, values = structure.unflatten(changed)
        return tear_matrix(program, Known(params, values, known.time))

    plain, changed = jax.vmap(matrix)(jnp.array([0.0, CHANGE]))
    # Logarithms, since the determinant of a large block may be too large or small for a number.
    size, changed_size = (jnp.linalg.slogdet(item)[1] for item in (plain, changed))
    return jnp.any(changed_size - size > np.log(GROWTH))
