"""Invariants: constraints that the equations of motion preserve up to the integration error."""

import jax.numpy as jnp
import numpy as np
from jax import Array

from .._numbers import Numbers
from .constraints import placed
from .groups import group_residuals
from .program import residual_program_of
from .starts import Inputs
from .system import System


def missed_invariants(system: System, t: Numbers, y: Array, inputs: Inputs) -> Array:
    """The residuals of the invariants at a point."""
    ordered = system.ordered
    rows = sorted(ordered.invariants)
    groups = system.plan.residual_groups(residual_program_of(ordered, [row], system.kind_index) for row in rows)
    inputs = system.carried.with_discrete(inputs, y)
    store = system.evaluate(t, y, inputs, [], {segment for group in groups for segment in group.depends})
    parts = [jnp.ravel(r) for group in groups for r in group_residuals(group, store, inputs.params)]
    return jnp.concatenate(parts) if parts else jnp.zeros(0)


def discrete_in_invariants(system: System) -> np.ndarray:
    """The positions, in a point, of the discrete variables that invariants read."""
    carried = system.carried
    keys = {key for group in system.invariants.groups for key in group.program.params}
    leaves = sorted(leaf for key in keys if carried.is_discrete(key) for leaf in carried.leaves_of(key))
    return np.concatenate([np.zeros(0, int), *(carried.discrete_places[leaf] for leaf in leaves)])


def onto_invariants(system: System, t: Numbers, y: Array, inputs: Inputs) -> Array:
    """Projects the states of a point onto the invariants. The correction is within the integration error."""
    states, invariants = y[: len(system.nominals)], system.invariants
    if not system.ordered.invariants:
        return states
    inputs = system.carried.with_discrete(inputs, y)
    x = system.collected(t, y, inputs, invariants.pairs)
    moved = invariants.projected(x, invariants.weights(), t, inputs.params)
    return placed(states, invariants.in_state_vector, moved[invariants.states])
