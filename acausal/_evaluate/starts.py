"""Start values: one number for all the aliases of a variable."""

import dataclasses
import functools as ft
import math
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._reduce.aliases import Merged
from .._reduce.flatten import FlatLeaf, FlatModel


@jax.tree_util.register_dataclass
@dataclasses.dataclass
class Inputs:
    """Numbers of a model as its compiled system takes them: `params` by class and slot, `starts` of all variables.

    `given` are the numbers of the leaves whose start values the model gives. `discrete` holds the discrete variables,
    where events have changed them.
    """

    params: dict[tuple[int, int], Any]
    starts: Float[Array, " elements"]
    given: frozenset[int] = dataclasses.field(metadata={"static": True})
    discrete: Any = None


@dataclasses.dataclass(eq=False)
class Starts:
    """How the start values in a model's leaves, as one vector, make up those of its variables.

    What is given for one alias holds for all; where none is given, the class of one that is not zero.
    """

    flat: FlatModel
    merged: Merged

    def pack(self, leaves: Sequence[Any]) -> Any:
        """All start values, from the leaves in pytree order, None where not given; plain numbers stay on the host."""
        variable = [(leaves[i], self.flat.leaves[i]) for i in self.flat.variable_leaves]
        values = [leaf.declaration.start if value is None else value for value, leaf in variable]
        if all(isinstance(value, float) for value in values):
            return np.repeat(np.array(values), self._elements)
        xp = np if all(isinstance(value, float | np.ndarray) for value in values) else jnp
        shapes = [leaf.stack + leaf.sizes for _, leaf in variable]
        return xp.concatenate([xp.ravel(xp.broadcast_to(v, shape)) for v, shape in zip(values, shapes, strict=True)])

    def value(self, inputs: Inputs, node: int) -> Any:
        """The start value of a representative node: the mean of those given for its aliases."""
        rows = self._rows(inputs, node)
        total = rows[0] if len(rows) == 1 else jnp.mean(rows, axis=0)
        return total.reshape(self._sizes(node))

    def spread(self, inputs: Inputs, node: int) -> Any:
        """The largest difference between that mean and what it was made from."""
        if not self.is_given(inputs.given, node):
            return jnp.zeros(self._elements_of(node))
        rows = self._rows(inputs, node)
        return jnp.max(jnp.abs(rows - jnp.mean(rows, axis=0)), axis=0)

    def is_given(self, given: frozenset[int], node: int) -> bool:
        """Whether a start value is given for one of the aliases of a node."""
        return bool(self._given(given, self._aliases(node)).any())

    def _rows(self, inputs: Inputs, node: int) -> Any:
        """The start values that count (aliases x elements), with the sign of the representative."""
        aliases = self._aliases(node)
        chosen = self._given(inputs.given, aliases)
        if not chosen.any():
            chosen = np.array([self._leaf(alias).declaration.start != 0 for alias in aliases])
        if not chosen.any():
            chosen = np.arange(len(aliases)) == 0
        aliases = aliases[chosen]
        places = self._starts_of[aliases][:, None] + np.arange(self._elements_of(node))
        return jnp.asarray(inputs.starts)[places] * self.merged.sign[aliases][:, None]

    def _given(self, given: frozenset[int], aliases: np.ndarray) -> np.ndarray:
        return np.array([int(self.flat.leaf_of_node[alias]) in given for alias in aliases], dtype=bool)

    def _leaf(self, node: int) -> FlatLeaf:
        return self.flat.leaves[self.flat.leaf_of_node[node]]

    def _elements_of(self, node: int) -> int:
        return math.prod(self._sizes(node))

    def _aliases(self, node: int) -> np.ndarray:
        keys, nodes = self._by_representative
        first, last = np.searchsorted(keys, [node, node + 1])
        return nodes[first:last]

    def _sizes(self, node: int) -> tuple[int, ...]:
        return self._leaf(node).sizes

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
