"""Looking into the engine from tests."""

import functools as ft
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from acausal import Component, System
from acausal._evaluate.initial import initial_state
from acausal._evaluate.observe import observe
from acausal._integrate.simulate import system_of


def values_at_start(model: Component, system: System | None = None) -> dict[str, np.ndarray]:
    """All variables of a model at its consistent start, by name."""
    system = system_of(model) if system is None else system

    @jax.jit
    def at_start(inputs: Any) -> list[Any]:
        y, _ = initial_state(system, jnp.asarray(0.0), inputs)
        return observe(system, jnp.asarray(0.0), y, inputs, system.flat.variable_leaves)

    found: dict[str, np.ndarray] = {}
    for number, value in zip(system.flat.variable_leaves, at_start(system.pack(model)), strict=True):
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
