"""Start values: one number for all aliases of a variable."""

import dataclasses
import functools as ft
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._numbers import Numbers
from .._reduce.aliases import Merged
from .._reduce.flat_model import FlatLeaf, FlatModel
from .._reduce.incidence import Incidence, Pair
from .._tracing import are_traced, is_traced
from .groups import Guess, ModelParameters
from .plan import Plan


@jax.tree_util.register_dataclass
@dataclasses.dataclass
class Inputs:
    """The inputs of a compiled system: parameters, and `starts` of all variables.

    `given` are the leaves, by number, whose start values the model gives. `discrete` holds discrete variables that
    events have changed. `apart` holds start values that are separate arguments of a run, by number of their leaf; they
    replace those among `starts`.
    """

    params: ModelParameters
    starts: Float[Numbers, " elements"]
    given: frozenset[int] = dataclasses.field(metadata={"static": True})
    discrete: Array | None = None
    apart: Mapping[int, Numbers] = dataclasses.field(default_factory=dict)


class _Sources(NamedTuple):
    """The sources of the start values of elements: positions in the vector of all, signs, and which of them count."""

    places: np.ndarray  # [elements, most aliases]
    signs: np.ndarray
    counts: np.ndarray
    is_given: np.ndarray  # [elements]


@dataclasses.dataclass(eq=False)
class Starts:
    """The start values of variables, from those of a model's leaves in one vector.

    A value given for one alias applies to all. If none is given, a nonzero default of an alias applies, that of a
    component before that of a port.
    """

    flat: FlatModel
    merged: Merged

    def pack(self, leaves: Sequence[Numbers | None]) -> Numbers:
        """All start values, from the leaves in pytree order; None for a missing one. Plain numbers stay on the host."""
        variable = [(leaves[i], self.flat.leaves[i]) for i in self.flat.variable_leaves]
        values = [leaf.declaration.guess if value is None else value for value, leaf in variable]
        if all(isinstance(value, float) for value in values):
            return np.repeat(np.array(values), self._elements)
        values = [value if is_traced(value) else np.asarray(value) for value in values]
        xp = jnp if are_traced(values) else np
        shapes = [leaf.stack + leaf.sizes for _, leaf in variable]
        return xp.concatenate([xp.ravel(xp.broadcast_to(v, shape)) for v, shape in zip(values, shapes, strict=True)])

    def whole(self, inputs: Inputs) -> Array:
        """All start values, including those that are apart."""
        starts = jnp.asarray(inputs.starts)
        parts, done = [], 0
        for leaf, value in sorted(inputs.apart.items()):
            declared, own = self.flat.leaves[leaf], self._slice(leaf)
            parts += [starts[done : own.start], jnp.ravel(jnp.broadcast_to(value, declared.stack + declared.sizes))]
            done = own.stop
        return jnp.concatenate([*parts, starts[done:]]) if parts else starts

    def values(self, inputs: Inputs, nodes: Sequence[int]) -> Array:
        """The start values of representative nodes, concatenated: each the mean of those of its aliases."""
        return self._mean(inputs, self._sources(inputs.given, tuple(nodes)))

    def spreads(self, inputs: Inputs, nodes: Sequence[int]) -> Array:
        """The largest deviation of the start values of the aliases of a node from their mean; zero if none is given."""
        sources = self._sources(inputs.given, tuple(nodes))
        if sources.places.shape[1] == 1:
            return jnp.zeros(len(sources.places))
        values = jnp.asarray(inputs.starts)[sources.places] * sources.signs
        apart = jnp.abs(values - self._mean(inputs, sources)[:, None])
        return jnp.max(jnp.where(sources.counts & sources.is_given[:, None], apart, 0.0), axis=1)

    def _mean(self, inputs: Inputs, sources: "_Sources") -> Array:
        values = jnp.asarray(inputs.starts)[sources.places] * sources.signs
        if values.shape[1] == 1:
            return values[:, 0]
        return jnp.sum(jnp.where(sources.counts, values, 0.0), axis=1) / np.sum(sources.counts, axis=1)

    def of_leaf(self, inputs: Inputs, leaf: int) -> Array:
        """The start values in one leaf."""
        return jnp.asarray(inputs.starts)[self._slice(leaf)]

    def of_scalars(self, inputs: Inputs, leaves: Sequence[int]) -> Array:
        """The start values in leaves of one number each."""
        return jnp.asarray(inputs.starts)[self._ends[[self._place_of_leaf[leaf] for leaf in leaves]]]

    def leaves_behind(self, given: frozenset[int], nodes: Sequence[int]) -> frozenset[int]:
        """The numbers of the leaves that determine the start values of representative nodes."""
        aliases = [self._counted(given, node) for node in nodes]
        return frozenset(self.flat.leaf_of_node[np.concatenate([np.zeros(0, int), *aliases])].tolist())

    def is_given(self, given: frozenset[int], node: int) -> bool:
        """Whether a start value is given for an alias of a node."""
        return bool(self._given(given, self._aliases(node)).any())

    @ft.cached_property
    def _cache(self) -> dict[tuple[frozenset[int], tuple[int, ...]], "_Sources"]:
        return {}

    def _sources(self, given: frozenset[int], nodes: tuple[int, ...]) -> "_Sources":
        if (given, nodes) not in self._cache:
            self._cache[given, nodes] = self._made(given, nodes)
        return self._cache[given, nodes]

    def _made(self, given: frozenset[int], nodes: tuple[int, ...]) -> "_Sources":
        counted = [self._counted(given, node) for node in nodes]
        sizes = [self._elements_of(node) for node in nodes]
        width = max([len(aliases) for aliases in counted], default=1)
        total, first = sum(sizes), np.cumsum([0, *sizes])
        places, signs, counts = np.zeros((total, width), int), np.ones((total, width)), np.zeros((total, width), bool)
        for aliases, start, size in zip(counted, first, sizes, strict=False):
            rows, own = slice(start, start + size), slice(0, len(aliases))
            places[rows, own] = self._starts_of[aliases] + np.arange(size)[:, None]
            signs[rows, own] = self.merged.sign[aliases]
            counts[rows, own] = True
        is_given = np.repeat(np.array([self.is_given(given, node) for node in nodes], bool), sizes)
        return _Sources(places, signs, counts, is_given)

    def _counted(self, given: frozenset[int], node: int) -> np.ndarray:
        """The aliases of a node whose start values count."""
        aliases = self._aliases(node)
        leaves = [self._leaf(alias) for alias in aliases]
        says = np.array([np.any(leaf.declaration.guess != 0.0) for leaf in leaves])
        in_port = np.array([leaf.in_port for leaf in leaves])
        for chosen in (self._given(given, aliases), says & ~in_port, says):
            if chosen.any():
                return aliases[chosen]
        return aliases[:1]

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

    def _slice(self, leaf: int) -> slice:
        """The positions of a leaf in the vector of all start values."""
        place = self._place_of_leaf[leaf]
        first, last = self._ends[place : place + 2]
        return slice(int(first), int(last))

    @ft.cached_property
    def _place_of_leaf(self) -> dict[int, int]:
        return {leaf: place for place, leaf in enumerate(self.flat.variable_leaves)}

    @ft.cached_property
    def _ends(self) -> np.ndarray:
        return np.cumsum([0, *self._elements])

    @ft.cached_property
    def _elements(self) -> np.ndarray:
        """The number of elements of each variable leaf."""
        leaves = [self.flat.leaves[i] for i in self.flat.variable_leaves]
        return np.array([leaf.count * math.prod(leaf.sizes) for leaf in leaves], dtype=int)

    @ft.cached_property
    def _by_representative(self) -> tuple[np.ndarray, np.ndarray]:
        order = np.argsort(self.merged.representative, kind="stable")
        return self.merged.representative[order], order

    @ft.cached_property
    def _starts_of(self) -> np.ndarray:
        """The first position of the values of each node in the vector."""
        leaves = [self.flat.leaves[i] for i in self.flat.variable_leaves]
        sizes = np.repeat([math.prod(leaf.sizes) for leaf in leaves], [leaf.count for leaf in leaves])
        return np.concatenate([[0], np.cumsum(sizes)])[:-1].astype(int)


@dataclasses.dataclass(frozen=True, eq=False)
class PairStarts:
    """The start values of pairs, a variable and the order of its derivative; zero for a derivative."""

    starts: Starts
    table: Incidence
    plan: Plan

    def values(self, inputs: Inputs, pairs: Sequence[Pair]) -> Float[Array, " elements"]:
        """The start values of pairs, concatenated."""
        return self._without_rates(self.starts.values(inputs, self._nodes(pairs)), pairs)

    def spreads(self, inputs: Inputs, pairs: Sequence[Pair]) -> Float[Array, " elements"]:
        """The spread of the start values that are given for the aliases of pairs."""
        return self._without_rates(self.starts.spreads(inputs, self._nodes(pairs)), pairs)

    def leaves_behind(self, given: frozenset[int], pairs: Sequence[Pair]) -> frozenset[int]:
        """The numbers of the leaves that determine the start values of pairs."""
        return self.starts.leaves_behind(given, self._nodes([(v, order) for v, order in pairs if order == 0]))

    def guess(self, inputs: Inputs) -> Guess:
        """Initial guesses for nonlinear solves."""

        def guess(pairs: Sequence[Pair]) -> Array:
            return self.values(inputs, pairs).reshape(len(pairs), 1, *self.plan.shapes[pairs[0][0]])

        return guess

    def _without_rates(self, values: Float[Array, " elements"], pairs: Sequence[Pair]) -> Array:
        is_rate = np.repeat([k > 0 for _, k in pairs], [self.plan.size(v) for v, _ in pairs]).astype(bool)
        return jnp.where(is_rate, 0.0, values) if np.any(is_rate) else values

    def _nodes(self, pairs: Sequence[Pair]) -> list[int]:
        return [int(self.table.variables[v]) for v, _ in pairs]
