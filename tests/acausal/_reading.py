"""Looking into the engine from tests."""

import functools as ft
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from acausal import Component, System
from acausal._evaluate.building import system_of
from acausal._evaluate.observe import observe


def values_without_states(model: Component) -> dict[str, np.ndarray]:
    """All variables of a model without states at time zero, by name."""
    system = system_of(model)
    assert len(system.nominals) == 0
    leaves = system.flat.variable_leaves
    values = jax.jit(lambda inputs: observe(system, jnp.asarray(0.0), jnp.zeros(0), inputs, leaves))(system.pack(model))
    found: dict[str, np.ndarray] = {}
    for number, value in zip(leaves, values, strict=True):
        leaf = system.flat.leaves[number]
        members = np.asarray(value).reshape(-1, *leaf.sizes)
        found |= {leaf.name(i): member for i, member in enumerate(members)}
    return found


def rates(model: Component, system: System, t: float, states: dict[str, Any]) -> dict[str, float]:
    """The time derivatives of scalar states, by the name of the state."""
    y = jnp.array([states[name] for name in system.state_names])
    return dict(zip(system.state_names, np.asarray(_vector_field(system)(t, y, system.pack(model))), strict=True))


@ft.lru_cache(maxsize=16)
def _vector_field(system: System) -> Any:
    return jax.jit(system.vector_field)
