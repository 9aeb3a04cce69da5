"""Parameters of a model, by component kind and slot."""

from collections.abc import Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np

from .._reduce.flatten import FlatLeaf, FlatModel
from .._tracing import is_traced

SEPARATE = 8  # up to so many members of a kind have parameters that are apart, more have arrays of them


def discrete_start(leaf: FlatLeaf, value: Any) -> Any:
    if leaf.declaration.role != "discrete":
        return value
    value = leaf.declaration.start if value is None else value
    shape = leaf.stack + leaf.sizes
    return jnp.broadcast_to(value, shape) if shape else value


def packed(flat: FlatModel, leaves: Sequence[Any], kind: int, slot: int) -> Any:
    instances = flat.holders[kind]
    sizes = instances.kind.sizes[slot]
    values = [leaves[first + slot] for first in instances.first_leaf]
    if instances.total > SEPARATE:
        # Thousands of separate numbers are collected fastest on the host.
        xp = jnp if any(is_traced(value) for value in values) else np
        return xp.concatenate([xp.reshape(xp.asarray(value), (-1, *sizes)) for value in values])
    members: list[Any] = []
    for value, stack in zip(values, instances.stacks, strict=True):
        members += list(jnp.reshape(value, (-1, *sizes))) if stack else [value]
    return tuple(members)
