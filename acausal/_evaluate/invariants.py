"""Invariants: constraints that the equations of motion keep, but for the error of integration."""

import jax.numpy as jnp
from jax import Array

from .._numbers import Numbers
from .constraints import placed
from .groups import group_residuals
from .program import residual_program_of
from .starts import Inputs
from .system import System


def missed_invariants(system: System, t: Numbers, y: Array, inputs: Inputs) -> Array:
    """The invariants as functions of the state vector, zero where they hold."""
    ordered = system.ordered
    rows = sorted(ordered.invariants)
    groups = system.plan.residual_groups(residual_program_of(ordered, [row], system.kind_index) for row in rows)
    store = system.evaluate(t, y, inputs, [], {segment for group in groups for segment in group.depends})
    parts = [jnp.ravel(r) for group in groups for r in group_residuals(group, store, inputs.params)]
    return jnp.concatenate(parts) if parts else jnp.zeros(0)


def onto_invariants(system: System, t: Numbers, y: Array, inputs: Inputs) -> Array:
    """The state vector moved onto the invariants; it has drifted by no more than an error of integration."""
    if not system.ordered.invariants:
        return y
    invariants = system.invariants
    x = system.collected(t, y, inputs, invariants.pairs)
    moved = invariants.projected(x, invariants.weights(), t, inputs.params)
    return placed(y, invariants.in_state_vector, moved[invariants.states])
