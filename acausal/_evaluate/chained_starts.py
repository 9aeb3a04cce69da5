"""Start values of dependent variables that follow from others one equation at a time."""

import dataclasses
import functools as ft
from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._numbers import Numbers
from .._reduce.incidence import Pair
from .._reduce.sort import Sorted, chain, entries_of
from .constraint_sets import remaining_constraints
from .constraints import Constraints
from .plan import Plan
from .program import chained_program_of
from .starts import Inputs
from .system import System


@dataclasses.dataclass(frozen=True, eq=False)
class ChainedStarts:
    """The start values of the constrained pairs. The search omits those that follow from others one equation at a time.

    Values that are `given`, a mask of elements, have priority over the remaining states.
    """

    system: System
    given: np.ndarray

    def values(self, x: Float[Array, " elements"], t: Numbers, inputs: Inputs) -> Float[Array, " elements"]:
        """A copy of x with the values that follow from others."""
        pairs = self.system.constraints.pairs
        store = self._plan.evaluate(x, t, inputs.params, self.system.starts.guess(inputs), pairs)
        return self._plan.collect(store, pairs)

    def guess(self, x: Float[Array, " elements"], t: Numbers, inputs: Inputs) -> Float[Array, " elements"]:
        """The initial guess of the search. It contains the values that follow from others, to avoid points without
        derivatives, such as a vector of zeros that is normalised.
        """
        found = self.values(x, t, inputs)
        return jnp.where(jnp.isfinite(found), found, x)

    @ft.cached_property
    def remaining(self) -> Constraints:
        """The constraints between the values that do not follow from others."""
        system = self.system
        return remaining_constraints(system.ordered, system.plan, system.kind_index, self._given_pairs)

    @ft.cached_property
    def places(self) -> np.ndarray:
        """The positions of the variables of `remaining` among the elements of the constrained pairs."""
        own = [self._plan.elements(pair) for pair in self.remaining.pairs]
        return np.concatenate([np.zeros(0, int), *own])

    @ft.cached_property
    def _given_pairs(self) -> list[Pair]:
        pairs = self.system.constraints.pairs
        ends = np.cumsum([self.system.plan.size(variable) for variable, _ in pairs])
        return [pair for pair, end in zip(pairs, ends.tolist(), strict=True) if self.given[end - 1]]

    @ft.cached_property
    def _plan(self) -> Plan:
        system, ordered = self.system, self.system.ordered
        steps = chain(ordered, ordered.constraints, self._given_pairs, ordered.states)
        levels = _levels(ordered, steps)
        uses = [(levels[step[1]], chained_program_of(ordered, [step], [], system.kind_index)) for step in steps]
        return Plan(uses, system.constraints.pairs, system.plan.shapes)


def _levels(ordered: Sorted, steps: Sequence[tuple[int, Pair]]) -> dict[Pair, int]:
    """The number of steps before each one on the longest path."""
    levels: dict[Pair, int] = {}
    for row, pair in steps:
        levels[pair] = 1 + max([levels.get(other, 0) for other in entries_of(ordered, row) if other != pair], default=0)
    return levels
