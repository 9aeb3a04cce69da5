"""Packing of the parameters of a model for compiled functions."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._numbers import Numbers
from .._reduce.flat_model import FlatLeaf, FlatModel
from .._tracing import is_traced

SEPARATE = 8  # number of members of a kind up to which each has its own number; more share an array


@jax.tree_util.register_dataclass
@dataclasses.dataclass
class SlotValues:
    """One parameter of all components of a kind: separate `members` if they are few, otherwise one array."""

    members: Any

    def of(self, member: int) -> Array:
        """The value of one member."""
        return self.members[member]

    @property
    def stacked(self) -> Array:
        """The values of all members as one array."""
        if isinstance(self.members, tuple):
            return jnp.stack([jnp.asarray(value) for value in self.members])
        return self.members

    def picked(self, members: np.ndarray) -> Array:
        """The values of some members as one array."""
        array = self.stacked
        if np.array_equal(members, np.arange(len(array))):
            return array
        if np.all(np.diff(members) == 1):
            return jax.lax.slice_in_dim(array, int(members[0]), int(members[-1]) + 1)
        return array[members]


@jax.tree_util.register_dataclass
@dataclasses.dataclass
class ModelParameters:
    """Parameters and discrete variables of a model: `slots` by component kind and slot, for the equations, and `leaves`
    by number, for functions of the whole model.

    `ahead` is the time by which equations are ahead, by component kind and name, an element for each member. It is
    empty except between the events of one instant.
    """

    slots: dict[tuple[int, int], SlotValues] = dataclasses.field(default_factory=dict)
    leaves: dict[int, Numbers] = dataclasses.field(default_factory=dict)
    ahead: dict[tuple[int, str], Array] = dataclasses.field(default_factory=dict)

    def changed(self, values: Mapping[int, Numbers]) -> "ModelParameters":
        """A copy with other values of some leaves; the slots must be filled again."""
        return ModelParameters(leaves=self.leaves | dict(values))


def discrete_start(leaf: FlatLeaf, value: Numbers | None) -> Any:
    if leaf.declaration.role != "discrete":
        return value
    value = leaf.declaration.guess if value is None else value
    shape = leaf.stack + leaf.sizes
    return jnp.broadcast_to(value, shape) if shape else value


def slot_values(flat: FlatModel, leaves: Mapping[int, Numbers], kind: int, slot: int) -> SlotValues:
    """One parameter of a component kind, from leaves by number."""
    instances = flat.holders[kind]
    sizes = instances.kind.sizes[slot]
    values = [leaves[instances.leaf(entry, slot)] for entry in range(len(instances.paths))]
    if instances.total > SEPARATE:
        # The host collects thousands of separate numbers fastest.
        xp = jnp if any(is_traced(value) for value in values) else np
        return SlotValues(xp.concatenate([xp.reshape(xp.asarray(value), (-1, *sizes)) for value in values]))
    members: list[Numbers] = []
    for value, stack in zip(values, instances.stacks, strict=True):
        members += list(jnp.reshape(value, (-1, *sizes))) if stack else [value]
    return SlotValues(tuple(members))
