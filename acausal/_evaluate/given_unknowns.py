"""Start values given for algebraic unknowns, which depend on the states: conditions on the start values of states."""

import dataclasses
from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import PyTree

from .._numbers import Numbers
from .._reduce.incidence import Pair
from .constraints import TOLERANCE, find, loose_inverse, projected
from .dependence import dependence
from .starts import Inputs
from .system import System


def given_unknowns(system: System, given: frozenset[int]) -> list[Pair]:
    """Algebraic unknowns whose given start values are conditions on the start values of states.

    The value of an unknown of a nonlinear block is a condition if it is declared `is_fixed`, or if the unknown depends
    on a state without a given value. Otherwise it is only the initial guess of the iterations.
    """
    nodes = [node for i in sorted(given) for node in system.flat.leaves[i].nodes]
    pairs = dict.fromkeys(pair for pair in (system.pair_of_node(node)[0] for node in nodes) if pair is not None)
    if not pairs:
        return []
    guesses = unknowns_of_iterations(system).intersection(pairs) - system.constrained - _fixed(system, given)
    conditions = _depending_on_free_states(system, given, sorted(guesses)) if guesses else set()
    return [pair for pair in pairs if pair not in system.constrained and pair not in guesses - conditions]


def unknowns_of_iterations(system: System) -> set[Pair]:
    """The unknowns of nonlinear blocks, whose start values are initial guesses, too."""
    return {system.ordered.unknowns[u] for torn in system.torn if torn.method == "nonlinear" for u in torn.unknowns}


def _fixed(system: System, given: frozenset[int]) -> set[Pair | None]:
    leaves = [system.flat.leaves[i] for i in given]
    return {system.pair_of_node(node)[0] for leaf in leaves if leaf.declaration.is_fixed for node in leaf.nodes}


def _depending_on_free_states(system: System, given: frozenset[int], pairs: Sequence[Pair]) -> set[Pair]:
    """The unknowns that depend on a state that neither is given nor is tied to given values by constraints."""
    plan = (system.solved or system).plan
    known = {pair for pair in system.constraints.pairs if pair[1] == 0 and _is_given(system, given, pair)}
    tied = [set(use.values) for group in system.constraints.groups for use in group.uses]
    settled = known.union(*(values for values in tied if not known.isdisjoint(values)))
    is_free = [np.full(plan.size(v), k == 0 and (v, k) not in settled) for v, k in system.states]
    columns = np.flatnonzero(np.concatenate([np.zeros(0, bool), *is_free]))
    if not columns.size:
        return set()
    depends = np.diff(dependence(plan, pairs)[:, columns].indptr) > 0
    names = [pair for pair in pairs for _ in range(plan.size(pair[0]))]
    return {pair for pair, is_moved in zip(names, depends.tolist(), strict=True) if is_moved}


def _is_given(system: System, given: frozenset[int], pair: Pair) -> bool:
    return system.intake.starts.is_given(given, int(system.ordered.table.variables[pair[0]]))


def leaves_of_unknowns(system: System, given: frozenset[int], pairs: Sequence[Pair]) -> list[int]:
    """The given leaves, by number, all of whose elements are among these unknowns, and are no initial guesses."""
    leaves, own = system.flat.leaves, set(pairs) - unknowns_of_iterations(system)
    return [i for i in sorted(given) if all(system.pair_of_node(node)[0] in own for node in leaves[i].nodes)]


@dataclasses.dataclass
class GivenUnknowns:
    """The conditions that the algebraic unknowns `pairs` have their start values, and their solution."""

    system: System
    t0: Numbers
    inputs: Inputs
    given: np.ndarray
    pairs: list[Pair]

    def solved(self, x: Array, bad: Array) -> tuple[Array, Array]:
        """The nearest point to x that satisfies these conditions and the constraints, and `bad` with the contradicted
        values.

        If there is no such point, x is unchanged.
        """
        constraints = self.system.constraints
        sizes, before = constraints.sizes, self._lack(x, self.t0, self.inputs)
        start = x
        if len(x):
            weight, args = constraints.weights(self.given), (self.t0, self.inputs)
            end = sizes * projected(self._residual, x / sizes, weight, args, find, loose_inverse)
            x = jnp.where(jnp.all(jnp.isfinite(end)), end, x)
        shift = self.given & ~(jnp.abs(x - start) <= TOLERANCE * (sizes + jnp.abs(start)))
        after = self._lack(x, self.t0, self.inputs)
        clash = jnp.any(shift) & (jnp.abs(before) > TOLERANCE) | ~(jnp.abs(after) <= TOLERANCE)
        return x, jnp.concatenate([clash, bad])

    def _residual(self, z: Array, args: PyTree) -> Array:
        (t0, inputs), constraints = args, self.system.constraints
        x = z * constraints.sizes
        return jnp.concatenate([constraints.residuals(x, t0, inputs.params), self._lack(x, t0, inputs)])

    def _lack(self, x: Array, t0: Numbers, inputs: Inputs) -> Array:
        return lack_of_given(self.system, t0, x[self.system.constraints.states], inputs, self.pairs)


def lack_of_given(system: System, t0: Numbers, states: Array, inputs: Inputs, pairs: Sequence[Pair]) -> Array:
    """Deviations of unknowns from their start values, relative to their sizes."""
    wanted = system.starts.values(inputs, pairs)
    values = (system.solved or system).collected(t0, states, inputs, pairs)
    return (values - wanted) / (system.sizes_of(pairs) + jnp.abs(wanted))
