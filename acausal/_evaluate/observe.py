"""Values of a model's leaves at a point of the solution, and of all its variables as one vector."""

import dataclasses
import math
from collections.abc import Iterable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._errors import ModelError
from .._numbers import Numbers
from .._reduce.aliases import TIME
from .._reduce.incidence import Pair
from .._tracing import are_traced
from .affine import computed, times
from .groups import Segments
from .starts import Inputs
from .system import System


def observe(system: System, t: Numbers, y: Array, inputs: Inputs, leaves: Sequence[int]) -> list[Numbers]:
    """The values of variable leaves, identified by number, at time `t` and state `y`.

    The time may be that of an event, after which the memory in `y` is a bad guess: iterations that fail start afresh.
    """
    store = system.evaluate(t, y, inputs, pairs_of(system, leaves), anew=True)
    return [leaf_value(system, store, leaf, t) for leaf in leaves]


def pairs_of(system: System, leaves: Iterable[int]) -> list[Pair]:
    """The pairs that determine the values of variable leaves."""
    found = {pair for leaf in leaves for pair, _ in _pairs(system, leaf) if pair is not None}
    return sorted(found)


def observe_with_rates(
    system: System, t: Numbers, y: Array, inputs: Inputs, leaves: Sequence[int], moving: Sequence[int]
) -> tuple[dict[int, Numbers], dict[int, Numbers]]:
    """The values of variable leaves by number, and the total time derivatives of `moving` ones.

    The system itself computes most derivatives. Others are directional derivatives along its vector field.
    """
    rates = {leaf: found for leaf in moving if (found := _rates(system, leaf)) is not None}
    others = [leaf for leaf in moving if leaf not in rates]
    wanted = {pair for item in rates.values() for pair, _ in item if pair is not None}
    states = [(variable, order + 1) for variable, order in system.states] if others else []
    store = system.evaluate(t, y, inputs, sorted({*pairs_of(system, leaves), *wanted, *states}))
    values = {leaf: leaf_value(system, store, leaf, t) for leaf in leaves}
    rates = {leaf: _stacked(system, store, leaf, item, 1.0) for leaf, item in rates.items()}
    if others:
        direction = (jnp.ones_like(t), system.plan.collect(store, states))
        along = jax.jvp(lambda t, y: observe(system, t, y, inputs, others), (t, y), direction)[1]
        rates |= dict(zip(others, along, strict=True))
    return values, rates


def _rates(system: System, leaf: int) -> list[tuple[Pair | None, int]] | None:
    """The pairs that are the derivatives of a leaf, with signs, like `_pairs` for its values; None if the system does
    not compute all of them.
    """
    found = [(None if pair is None else (pair[0], pair[1] + 1), sign) for pair, sign in _pairs(system, leaf)]
    return found if all(pair is None or pair in system.plan.places for pair, _ in found) else None


def _pairs(system: System, leaf: int) -> list[tuple[Pair | None, int]]:
    return [system.pair_of_node(node) for node in system.flat.leaves[leaf].nodes]


def leaf_value(system: System, store: Segments, leaf: int, t: Numbers) -> Numbers:
    """The value of a variable leaf, from the values computed at a point."""
    return _stacked(system, store, leaf, _pairs(system, leaf), t)


def _stacked(
    system: System, store: Segments, leaf: int, pairs: list[tuple[Pair | None, int]], time: Numbers
) -> Numbers:
    """The values of the pairs of a leaf; a pair of the time has the value `time`."""
    flat_leaf = system.flat.leaves[leaf]
    known = [pair for pair, _ in pairs if pair is not None]
    values = store.single(system.plan.read(known)) if len(pairs) == len(known) == 1 else None
    if values is not None:
        return jnp.reshape(computed(times(values, float(pairs[0][1]))), flat_leaf.stack + flat_leaf.sizes)
    shape = (-1,) + (1,) * len(flat_leaf.sizes)
    is_known = np.array([pair is not None for pair, _ in pairs])
    stacked = jnp.zeros((len(pairs), *flat_leaf.sizes))
    if known:
        signs = np.array([sign for _, sign in pairs]).reshape(shape)
        # A gather, not a scatter: XLA on the CPU does not compile a loop with scatters as one function.
        found = store.gather(system.plan.read([known[0] if pair is None else pair for pair, _ in pairs]))
        stacked = jnp.where(is_known.reshape(shape), signs * found, stacked)
    timed = np.array([pair is None and sign == 1 for pair, sign in pairs])
    stacked = jnp.where(timed.reshape(shape), time, stacked)
    return stacked.reshape(flat_leaf.stack + flat_leaf.sizes)


def constrained_places(system: System, leaf: int) -> tuple[np.ndarray, np.ndarray]:
    """The positions of the elements of a leaf among the constrained pairs, and their signs.

    Raises `ModelError` for an algebraic variable, which cannot be set.
    """
    pairs, plan = system.constraints.pairs, system.plan
    first = dict(zip(pairs, np.cumsum([0, *(plan.size(v) for v, _ in pairs)]).tolist(), strict=False))
    places, signs = [], []
    for i, (pair, sign) in enumerate(_pairs(system, leaf)):
        if pair is None or pair not in first:
            raise ModelError(
                f"An event sets {system.flat.leaves[leaf].name(i)}, which is neither a state nor tied to states by "
                "constraints: its value follows from an equation. Change a variable that this equation depends on."
            )
        size = plan.size(pair[0])
        places.append(first[pair] + np.arange(size))
        signs.append(np.full(size, sign))
    return np.concatenate(places), np.concatenate(signs)


@dataclasses.dataclass(frozen=True, eq=False)
class AllValues:
    """The distinct variables of a system, and their places in its variable leaves.

    `places` are those of the elements of all variable leaves in a vector of the distinct variables, zero and time.
    """

    system: System
    pairs: list[Pair]
    places: np.ndarray
    signs: np.ndarray

    @property
    def count(self) -> int:
        """The number of elements of the distinct variables."""
        return sum(self.system.plan.size(variable) for variable, _ in self.pairs)

    def vector(self, t: Numbers, y: Array, inputs: Inputs) -> Array:
        """The distinct variables at time `t` and state `y`, and the discrete variables if they are known.

        The time may be that of an event, after which the memory in `y` is a bad guess: iterations that fail start
        afresh.
        """
        values = self.system.collected(t, y, inputs, self.pairs, anew=True)
        discrete = self.system.carried.discrete_values(y, inputs)
        return jnp.concatenate([values, *(jnp.ravel(value) for value in discrete.values())])

    def leaves(self, ts: Any, vectors: Any) -> dict[int, Any]:
        """The values of leaves by number, from vectors at times; known vectors are distributed by numpy."""
        flat = self.system.flat
        xp = jnp if are_traced(ts, vectors) else np
        ts, vectors = xp.asarray(ts), xp.asarray(vectors)
        distinct, discrete = vectors[..., : self.count], vectors[..., self.count :]
        known = xp.concatenate([distinct, xp.zeros((*ts.shape, 1)), ts[..., None]], axis=-1)
        all_values = self.signs * known[..., self.places]
        parts = [(flat.variable_leaves, all_values)]
        if discrete.shape[-1]:
            parts.append((flat.discrete_leaves, discrete))
        found: dict[int, Any] = {}
        for leaves, values in parts:
            shapes = [flat.leaves[i].stack + flat.leaves[i].sizes for i in leaves]
            ends = np.cumsum([math.prod(shape) for shape in shapes]).tolist()
            for leaf, shape, start, end in zip(leaves, shapes, [0, *ends], ends, strict=False):
                found[leaf] = values[..., start:end].reshape(ts.shape + shape)
        return found


def all_values_of(system: System) -> AllValues:
    """The distribution of the variables of a system."""
    flat, merged, plan = system.flat, system.merged, system.plan
    sizes = np.array([plan.size(variable) for variable in range(len(plan.shapes))], int)
    is_known = merged.representative >= 0
    number = np.array(system.ordered.table.number_of_node)[np.where(is_known, merged.representative, 0)]
    variables, own = np.unique(number[is_known], return_inverse=True)
    first = np.cumsum([0, *sizes[variables]])
    place = np.where(merged.representative == TIME, first[-1] + 1, first[-1])
    place[is_known] = first[own]
    counts = np.array([math.prod(flat.leaves[leaf].sizes) for leaf in flat.leaf_of_node], int)
    inside = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    places = np.repeat(place, counts) + np.where(np.repeat(is_known, counts), inside, 0)
    signs = np.repeat(np.where(is_known, merged.sign, 1), counts).astype(float)
    return AllValues(system, [(int(variable), 0) for variable in variables], places, signs)
