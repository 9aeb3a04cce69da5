"""Start values: one number for all the aliases of a variable."""

import dataclasses
import functools as ft
import math
from collections.abc import Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._reduce.aliases import Merged
from .._reduce.flatten import FlatModel


@dataclasses.dataclass(eq=False)
class Starts:
    """How the start values in a model's leaves, as one vector, make up those of its variables.

    A start value of zero counts as not given; what is given for one alias holds for all.
    """

    flat: FlatModel
    merged: Merged

    def pack(self, leaves: Sequence[Any]) -> Any:
        """All start values, from the leaves in pytree order; plain numbers without touching the device."""
        values = [leaves[i] for i in self.flat.variable_leaves]
        if all(isinstance(value, float) for value in values):
            return np.repeat(np.array(values), self._elements)
        shapes = [self.flat.leaves[i].stack + self.flat.leaves[i].sizes for i in self.flat.variable_leaves]
        xp = np if all(isinstance(value, float | np.ndarray) for value in values) else jnp
        return xp.concatenate([xp.ravel(xp.broadcast_to(v, shape)) for v, shape in zip(values, shapes, strict=True)])

    def value(self, packed: Float[Array, " elements"], node: int) -> Any:
        """The start value of a representative node: the mean of those given for its aliases."""
        given = self._given(packed, node)
        total, count = jnp.sum(given, axis=0), jnp.sum(given != 0, axis=0)
        return (total / jnp.maximum(count, 1)).reshape(self._sizes(node))

    def spread(self, packed: Float[Array, " elements"], node: int) -> Any:
        """The largest difference between that mean and what it was made from."""
        given = self._given(packed, node)
        mean = jnp.ravel(self.value(packed, node))
        return jnp.max(jnp.where(given != 0, jnp.abs(given - mean), 0.0), axis=0)

    def places(self, node: int) -> np.ndarray:
        """Where the values of all aliases lie in the packed vector (members x elements)."""
        return self._starts_of[self._aliases(node)][:, None] + np.arange(math.prod(self._sizes(node)))

    def _given(self, packed: Any, node: int) -> Any:
        """Values of all aliases (members x elements), with the sign of the representative."""
        return jnp.asarray(packed)[self.places(node)] * self.merged.sign[self._aliases(node)][:, None]

    def _aliases(self, node: int) -> np.ndarray:
        keys, nodes = self._by_representative
        first, last = np.searchsorted(keys, [node, node + 1])
        return nodes[first:last]

    def _sizes(self, node: int) -> tuple[int, ...]:
        return self.flat.leaves[self.flat.leaf_of_node[node]].sizes

    @ft.cached_property
    def _elements(self) -> np.ndarray:
        """How many numbers each variable leaf has."""
        leaves = [self.flat.leaves[i] for i in self.flat.variable_leaves]
        return np.array([leaf.count * int(np.prod(leaf.sizes, dtype=int)) for leaf in leaves], dtype=int)

    @ft.cached_property
    def _by_representative(self) -> tuple[np.ndarray, np.ndarray]:
        order = np.argsort(self.merged.representative, kind="stable")
        return self.merged.representative[order], order

    @ft.cached_property
    def _starts_of(self) -> np.ndarray:
        """Where the values of each node begin in the vector."""
        leaves = [self.flat.leaves[i] for i in self.flat.variable_leaves]
        sizes = np.repeat([int(np.prod(leaf.sizes, dtype=int)) for leaf in leaves], [leaf.count for leaf in leaves])
        return np.concatenate([[0], np.cumsum(sizes)])[:-1].astype(int)
