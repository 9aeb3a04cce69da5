"""Augmented state of a run: after the states come the memory of iterations and the discrete variables."""

import dataclasses
import functools as ft
import math
from collections.abc import Sequence

import jax
import numpy as np
from jax import Array

from .._reduce.flat_model import FlatModel
from .._reduce.incidence import Pair
from .groups import Guess, slot_values
from .plan import Plan
from .starts import Inputs


@dataclasses.dataclass(frozen=True, eq=False)
class Carried:
    """Layout of a point [states, memory, discrete variables]; everything after the states can be missing.

    `memory` contains the unknowns of iterations: their last values are good initial guesses.
    """

    flat: FlatModel
    plan: Plan
    n_states: int
    memory: tuple[Pair, ...]

    @ft.cached_property
    def n_memory(self) -> int:
        return sum(self.plan.size(v) for v, _ in self.memory)

    @property
    def n_discrete(self) -> int:
        return sum(len(places) for places in self.discrete_places.values())

    @ft.cached_property
    def discrete_places(self) -> dict[int, np.ndarray]:
        """The positions of the elements of each discrete leaf."""
        places, start = {}, self._first_discrete
        for index in self.flat.discrete_leaves:
            places[index] = start + np.arange(math.prod(self._shape(index)))
            start += len(places[index])
        return places

    @property
    def _first_discrete(self) -> int:
        return self.n_states + self.n_memory

    def _shape(self, leaf: int) -> tuple[int, ...]:
        return self.flat.leaves[leaf].stack + self.flat.leaves[leaf].sizes

    def memory_of(self, y: Array) -> Guess | None:
        """The initial guesses in a point; None if it contains only states."""
        if len(y) == self.n_states:
            return None
        values = y[self.n_states : self._first_discrete]
        sizes = [self.plan.size(v) for v, _ in self.memory]
        first = dict(zip(self.memory, np.cumsum([0, *sizes]).tolist(), strict=False))

        def guess(pairs: Sequence[Pair]) -> Array:
            index = np.array([first[pair] + np.arange(self.plan.size(pair[0])) for pair in pairs])
            return values[index].reshape(len(pairs), 1, *self.plan.shapes[pairs[0][0]])

        return guess

    def discrete_values(self, y: Array, inputs: Inputs) -> dict[int, Array]:
        """The discrete leaves by number, from a point that contains them, otherwise from the inputs."""
        first = self._first_discrete
        end = first + self.n_discrete
        values = y[first:end] if len(y) >= end else inputs.discrete
        if values is None:
            return {}
        return {
            i: jax.lax.slice(values, (places[0] - first,), (places[-1] + 1 - first,)).reshape(self._shape(i))
            for i, places in self.discrete_places.items()
        }

    def with_discrete(self, inputs: Inputs, y: Array) -> Inputs:
        """The inputs with the discrete variables of a point."""
        values = self.discrete_values(y, inputs)
        if not values:
            return inputs
        params = inputs.params
        slots = {key: slot_values(self.flat, values, *key) for key in params.slots if self.is_discrete(key)}
        leaves = {i: value for i, value in values.items() if i in params.leaves}
        params = dataclasses.replace(params, slots=params.slots | slots, leaves=params.leaves | leaves)
        return dataclasses.replace(inputs, params=params)

    def is_discrete(self, key: tuple[int, int]) -> bool:
        """Whether a slot of a component kind holds a discrete variable."""
        kind, slot = key
        return self.flat.holders[kind].kind.declarations[slot].role == "discrete"

    def leaves_of(self, key: tuple[int, int]) -> list[int]:
        """The leaves, by number, of a slot of a component kind."""
        kind, slot = key
        holder = self.flat.holders[kind]
        return [holder.leaf(entry, slot) for entry in range(len(holder.paths))]
