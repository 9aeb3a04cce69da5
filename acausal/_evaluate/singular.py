"""Blocks of linear equations that determine their unknowns by rounding errors only."""

from typing import Any

import jax
import jax.numpy as jnp

from .blocks import Known, tear_matrix
from .plan import Pair, Store, over_members
from .program import Program
from .starts import Inputs
from .system import System

SENSITIVE = 1e13  # relative change of a determinant, for one of its coefficients, from which on it counts as zero


def singular_blocks(system: System, store: Store, inputs: Inputs) -> Any:
    """For each linear block, in the order of `linear_blocks`, whether it is singular but for rounding.

    Where coefficients cancel, as 0.3 - 0.1 * 3.0 does, what is left is an error of rounding and no NaN tells. But the
    determinant then is far smaller than what a relative change of 1 in the numbers that it is computed from does to it.
    """
    parts: list[Any] = [jnp.zeros(0, bool)]
    for group in system.plan.groups:
        if group.program.kind == "linear":
            parts.append(
                over_members(group, store, inputs.params, lambda known, _, g=group: _singular(g.program, known), [])
            )
    return jnp.concatenate(parts)


def linear_blocks(system: System) -> list[Pair]:
    """The first unknown of each linear block."""
    groups = [group for group in system.plan.groups if group.program.kind == "linear"]
    return [use.gives[0] for group in groups for use in group.uses]


def _singular(program: Program, known: Known) -> Any:
    numbers = (known.params, known.values)
    leaves, structure = jax.tree_util.tree_flatten(numbers)
    # Changes that differ, so that they do not cancel between coefficients.
    changes = [x * jnp.cos(1.0 + i + jnp.arange(x.size)).reshape(x.shape) for i, x in enumerate(leaves)]
    matrix, change = jax.jvp(
        lambda params, values: tear_matrix(program, Known(params, values, known.time)),
        numbers,
        structure.unflatten(changes),
    )
    growth = jnp.trace(jnp.linalg.solve(matrix, change), axis1=-2, axis2=-1)
    return jnp.any(jnp.abs(growth) > SENSITIVE)
