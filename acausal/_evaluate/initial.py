"""Consistent start values: the point that satisfies the constraints and the given start values."""

import dataclasses
import functools as ft
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from .._numbers import Numbers
from .._reduce.incidence import Pair
from .._reduce.sort import Sorted, chain, entries_of
from .._tracing import is_traced
from .constraints import TOLERANCE, Constraints, find, loose_inverse, placed, projected, remaining_constraints
from .dependence import dependence
from .groups import ModelParameters
from .intake import LARGE
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


def handed_inputs(system: System, params: ModelParameters, leaves: Sequence[Numbers | None]) -> Inputs:
    """The arguments of a compiled run: parameters in their compact form, and the start values.

    Traced start values of states are separate, unless there are very many, so that derivatives are only along those
    that vary. The other start values are initial guesses of iterations. No result depends on them, so they are
    constants.
    """
    starts, given = system.intake.starts, system.intake.given(leaves)
    traced = {i: value for i, value in enumerate(leaves) if i in given and is_traced(value)}
    decisive = decisive_leaves(system, given) if traced else ()
    apart: dict[int, Any] = {i: value for i, value in traced.items() if i in decisive}
    if len(apart) > LARGE:
        return Inputs(params, starts.pack(leaves), given)
    others = [
        None if i in apart else jax.lax.stop_gradient(value) if i in traced else value for i, value in enumerate(leaves)
    ]
    return Inputs(params, starts.pack(others), given, apart=apart)


def decisive_leaves(system: System, given: frozenset[int]) -> frozenset[int]:
    """The leaves, by number, that determine the start values of states."""
    pairs = [*system.states, *system.constraints.pairs, *given_unknowns(system, given)]
    return system.starts.leaves_behind(given, pairs)


def initial_state(system: System, t0: Numbers, inputs: Inputs) -> tuple[Array, Array]:
    """The initial state vector, and for each of `checked_names` whether its start value is contradicted.

    States keep their start values, unless values are given for variables that depend on them through constraints
    g(x) = 0, or the states are restricted themselves: then the start is the nearest point x0 - D g_x(x0)^T m (to first
    order), with m such that g = 0, where D lets dependent variables move freely, states only where they must, and given
    values not at all if there is another way. What is given for algebraic unknowns is a condition of the same kind.
    """
    given = given_pairs(system, inputs)
    unknowns = given_unknowns(system, inputs.given)
    if is_plain(system, given) and not unknowns:
        y = system.starts.values(inputs, system.states)
        return _with_algebraic(system, t0, y, inputs), _disagreement(system, inputs)
    x, bad = _projected(system, t0, inputs, given)
    if unknowns:
        x, bad = GivenUnknowns(system, t0, inputs, given, unknowns).solved(x, bad)
    return _with_algebraic(system, t0, x[system.constraints.states], inputs), bad


def _projected(system: System, t0: Numbers, inputs: Inputs, given: np.ndarray) -> tuple[Array, Array]:
    """The projection of the start point onto the constraints."""
    starts, x0 = ChainedStarts(system, given), start_point(system, inputs)
    rest, places = starts.remaining, starts.places
    first, weight = starts.guess(x0, t0, inputs), rest.weights(given[places])

    def project(x: Array, _: None) -> tuple[Array, None]:
        return rest.projected(jnp.where(given[places], x0[places], x), weight, t0, inputs.params, far=True), None

    # The constraints are nonlinear, so the first projection moves given values slightly. They are reset, and the
    # second projection, which starts near a solution, keeps them.
    found = jax.lax.scan(project, first[places], None, length=2)[0]
    x = starts.values(placed(first, places, found), t0, inputs)
    missed = given & ~(jnp.abs(x - x0) <= TOLERANCE * (system.constraints.sizes + jnp.abs(x0)))
    return x, jnp.where(jnp.any(missed), missed, _disagreement(system, inputs) | ~jnp.isfinite(x))


def start_point(system: System, inputs: Inputs) -> Array:
    """The start values of the constrained pairs, possibly inconsistent."""
    return system.starts.values(inputs, system.constraints.pairs)


def given_pairs(system: System, inputs: Inputs) -> np.ndarray:
    """For each element of the constrained pairs, whether the model gives its start value."""
    table, size = system.ordered.table, system.plan.size
    flags = [
        np.full(size(v), k == 0 and system.intake.starts.is_given(inputs.given, int(table.variables[v])))
        for v, k in system.constraints.pairs
    ]
    return np.concatenate(flags) if flags else np.zeros(0, bool)


def is_plain(system: System, given: np.ndarray) -> bool:
    """Whether the states can start from their own start values, without constraints or contradictions."""
    return not system.ordered.invariants and not np.any(given & ~system.constraints.is_state)


def has_modes(system: System) -> bool:
    """Whether the constraints between start values read discrete variables, such as the truths that `ifelse` holds."""
    return any(system.carried.is_discrete(key) for group in system.constraints.groups for key in group.program.params)


def _with_algebraic(system: System, t0: Numbers, y: Array, inputs: Inputs) -> Array:
    """The states, followed by the algebraic unknowns of the mass-matrix form at the start."""
    if system.solved is None:
        return y
    plan = system.solved.plan
    store = plan.evaluate(y, t0, inputs.params, system.starts.guess(inputs), system.algebraic)
    return jnp.concatenate([y, plan.collect(store, system.algebraic)])


def checked_names(system: System, given: frozenset[int]) -> list[str]:
    """The name of the variable of each element that `initial_state` checks."""
    return pair_names(system, given_unknowns(system, given)) + constrained_names(system)


def constrained_names(system: System) -> list[str]:
    """The name of the variable of each element of the constrained pairs."""
    return pair_names(system, system.constraints.pairs)


def pair_names(system: System, pairs: Sequence[Pair]) -> list[str]:
    """The name of the variable of each element of pairs."""
    table, size = system.ordered.table, system.plan.size
    return [table.variable_name(*pair) for pair in pairs for _ in range(size(pair[0]))]


def _disagreement(system: System, inputs: Inputs) -> Array:
    """Whether start values given for aliases of one variable differ."""
    return system.starts.spreads(inputs, system.constraints.pairs) > TOLERANCE * system.constraints.sizes
