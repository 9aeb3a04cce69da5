"""The values of all variables at a point: one vector of the distinct ones, and its distribution over the leaves."""

import dataclasses
import math
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from .._numbers import Numbers
from .._reduce.aliases import TIME
from .._reduce.incidence import Pair
from .._tracing import are_traced
from .starts import Inputs
from .system import System


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
