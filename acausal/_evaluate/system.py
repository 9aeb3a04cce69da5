"""The outcome of all structural passes: a system of ordinary differential equations with everything else explicit."""

import dataclasses
import functools as ft
import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._declare.component import Component
from .._declare.layout import complete_leaves
from .._errors import ModelError, ParameterError
from .._reduce.aliases import TIME, ZERO, Merged
from .._reduce.flatten import FlatLeaf, FlatModel
from .._reduce.index import Reduced
from .._reduce.ranges import Ranges, is_within, ranges_of_pair
from .._reduce.sort import Sorted
from .._reduce.states import Chosen, nominal_of
from .._reduce.tear import Torn
from .._tracing import known
from .constraints import Constraints, constraints_of, placed
from .events import EventSet, events_of
from .initial_equations import InitialEquations, initial_equations_of
from .instants import EquationInstants, equation_instants
from .packing import discrete_start, packed
from .plan import Group, Packed, Pair, Plan, Store, group_residuals
from .program import residual_programme
from .requirements import ModelRequirements
from .starts import Inputs, Starts


@dataclasses.dataclass(eq=False, repr=False)
class System:
    """A model's equations, reduced and sorted; made by `compile` or, behind the scenes, by `simulate`.

    The state vector `y` holds `states` one after the other, each a (variable, derivative order) pair. In mass-matrix
    form it goes on with `algebraic` unknowns, the tearing variables of all simultaneous blocks, whose equations are
    left to the integrator: M dy/dt = f(t, y), with zeros in `mass` for them. `solved` is then the ordinary form.
    """

    flat: FlatModel
    merged: Merged
    reduced: Reduced
    chosen: Chosen
    ordered: Sorted
    torn: list[Torn]
    plan: Plan
    kind_index: dict[int, int]
    algebraic: list[Pair]
    made: tuple[Callable[..., "System"], tuple[Any, ...]]  # what it was made by, and from
    solved: "System | None" = None

    @property
    def name(self) -> str:
        """The class of the model."""
        return self.flat.name

    def __repr__(self) -> str:
        size = f"{len(self.states)} states, {len(self.torn)} blocks in {len(self.plan.groups)} groups"
        return f"<System of {self.name}: {size}>"

    def __reduce__(self) -> tuple[Callable[..., "System"], tuple[Any, ...]]:
        # Traced equations cannot be stored; what is stored is what they are made from.
        return self.made

    def __deepcopy__(self, memo: Any) -> "System":
        return self

    def __copy__(self) -> "System":
        return self

    @property
    def states(self) -> list[Pair]:
        return self.ordered.states

    @property
    def mass(self) -> np.ndarray | None:
        """The diagonal of the mass matrix, None where it is the identity."""
        if self.solved is None:
            return None
        return np.repeat([1.0, 0.0], [self.plan_size(self.states), self.plan_size(self.algebraic)])

    def plan_size(self, pairs: Sequence[Pair]) -> int:
        return sum(self.plan.size(v) for v, _ in pairs)

    @ft.cached_property
    def residuals(self) -> list[Group]:
        """The equations left to the integrator."""
        if self.solved is None:
            return []
        rows = [row for torn in self.torn for row in torn.residuals]
        return self.plan.residual_groups(residual_programme(self.ordered, [row], self.kind_index) for row in rows)

    @ft.cached_property
    def constraints(self) -> Constraints:
        """What relates the variables below their highest derivatives to each other, at every time."""
        return constraints_of(self.ordered, self.plan, self.kind_index, only_invariant=False)

    @ft.cached_property
    def constrained(self) -> frozenset[Pair]:
        """The variables below their highest derivatives, the states among them."""
        return frozenset(self.ordered.constrained)

    @ft.cached_property
    def invariants(self) -> Constraints:
        """The constraints on which the states of a run must be kept."""
        return constraints_of(self.ordered, self.plan, self.kind_index, only_invariant=True)

    @ft.cached_property
    def state_names(self) -> list[str]:
        """The name of each state; an array state has one name."""
        return [self.ordered.table.variable_name(*state) for state in self.states]

    @property
    def element_names(self) -> list[str]:
        """The name of the state behind each element of the state vector."""
        sizes = [self.plan.size(variable) for variable, _ in self.states]
        return [name for name, size in zip(self.state_names, sizes, strict=True) for _ in range(size)]

    def pack(self, model: Component) -> Inputs:
        """Parameters stacked per component class, and start values: what the compiled functions take."""
        return self.pack_leaves(complete_leaves(model)[0])

    def pack_leaves(self, leaves: Sequence[Any]) -> Inputs:
        """The same from the leaves of a model."""
        return Inputs(self.pack_params(self.parameters(leaves)), self.starts.pack(leaves), self.given(leaves))

    def parameters(self, leaves: Sequence[Any]) -> list[Any]:
        """The leaves of a model, None where they are variables; discrete ones as they are at the start."""
        return [
            None if i in self.variable_leaves else discrete_start(leaf, leaves[i])
            for i, leaf in enumerate(self.flat.leaves)
        ]

    def given(self, leaves: Sequence[Any]) -> frozenset[int]:
        """The variable leaves that have a start value in the model."""
        return frozenset(i for i in self.flat.variable_leaves if leaves[i] is not None)

    @ft.cached_property
    def variable_leaves(self) -> frozenset[int]:
        return frozenset(self.flat.variable_leaves)

    @ft.cached_property
    def nominals(self) -> np.ndarray:
        """The nominal size of each element of the state vector."""
        pairs = [*((v, 0) for v, _ in self.states), *self.algebraic]
        return self.sizes_of(pairs)

    def sizes_of(self, pairs: Sequence[Pair]) -> np.ndarray:
        """The nominal size of each element of pairs."""
        sizes = [np.full(self.plan.size(pair[0]), nominal_of(self.ordered.table, pair)) for pair in pairs]
        return np.concatenate([np.zeros(0), *sizes])

    def bad_values(self, inputs: Inputs) -> Any:
        """For each of the requirements, and of the start values that are given, whether it is not met."""
        checks = [self.requirements.broken(inputs.params)]
        for index in sorted(inputs.given):
            start = self.starts.of_leaf(inputs, index)
            checks.append(~jnp.all(_is_admitted(self.flat.leaves[index], start))[None])
        return jnp.concatenate(checks)

    def required(self, given: frozenset[int]) -> list[str]:
        """What each of `bad_values` is short of, as sentences."""
        return self.requirements.sentences + [_needed(self.flat.leaves[index]) for index in sorted(given)]

    def check_values(self, leaves: Sequence[Any]) -> None:
        """Raise `ParameterError` where parameters or given start values of a model are known and bad."""
        self.enforced(self.parameters(leaves))
        for index in sorted(self.given(leaves)):
            leaf, start = self.flat.leaves[index], known(jnp.asarray(leaves[index], float))
            if start is not None and not np.all(_is_admitted(leaf, start)):
                raise ParameterError(_bad_start(leaf, start))

    def bad_value(self, index: int, inputs: Inputs) -> str:
        """What one of `bad_values` is short of, with the numbers."""
        count = len(self.requirements.sentences)
        if index < count:
            return self.requirements.told(index, inputs.params)
        leaf = sorted(inputs.given)[index - count]
        return _bad_start(self.flat.leaves[leaf], np.asarray(self.starts.of_leaf(inputs, leaf)))

    @ft.cached_property
    def requirements(self) -> ModelRequirements:
        """What parameters have to meet."""
        return ModelRequirements(self.flat)

    def enforced(self, params: list[Any]) -> list[Any]:
        """Parameters that meet all requirements, from the leaves of a model, None where they are variables.

        Raises `ParameterError` where they do not; where they are not known, they become NaN.
        """
        return self.requirements.enforced(params, self.pack_params(params))

    @ft.cached_property
    def _used_params(self) -> list[tuple[int, int]]:
        groups = self.plan.groups + self.residuals + self.constraints.groups
        return sorted(
            {key for group in groups for key in group.program.params} | self.instants.keys | self.requirements.keys
        )

    def pack_params(self, leaves: Sequence[Any]) -> Packed:
        """Parameters, from the leaves of a model in pytree order, by component kind and slot."""
        return {key: packed(self.flat, leaves, *key) for key in self._used_params}

    def vector_field(self, t: Any, y: Float[Array, " n"], inputs: Inputs) -> Float[Array, " n"]:
        """f of the reduced system M dy/dt = f(t, y), with `inputs` from `pack`."""
        return self.vector_field_and_store(t, y, inputs, [])[0]

    def vector_field_and_store(
        self, t: Any, y: Any, inputs: Inputs, wanted: Sequence[Pair], *, watch: bool = False
    ) -> tuple[Float[Array, " n"], Store]:
        """The vector field, and what was computed for it and for further pairs.

        It is not a number where variables that it depends on leave their ranges; with `watch`, where any variable does.
        """
        watched = self._watched if watch else []
        store = self.evaluate(t, y, inputs, [*self._rates, *wanted, *watched], self._residual_segments)
        residuals = [jnp.ravel(r) for group in self.residuals for r in group_residuals(group, store, inputs.params)]
        rates = jnp.concatenate([self.plan.collect(store, self._rates), *residuals])
        if watched:
            inside = [jnp.all(is_within(self.plan.collect(store, [pair]), self._ranges(pair))) for pair in watched]
            rates = jnp.where(jnp.all(jnp.stack(inside)), rates, jnp.nan)
        return rates, store

    @property
    def _rates(self) -> list[Pair]:
        return [(variable, order + 1) for variable, order in self.states]

    @property
    def _residual_segments(self) -> set[int]:
        return {segment for group in self.residuals for segment in group.depends}

    def _ranges(self, pair: Pair) -> Ranges:
        return ranges_of_pair(self.ordered.table, pair)

    @ft.cached_property
    def _watched(self) -> list[Pair]:
        """The unknowns with ranges on which no rate depends, or of which that is not known."""
        places = self.plan.places
        segments = self._residual_segments | {places[pair].segment for pair in self._rates}
        read = segments.union(*(group.depends for group in self.plan.needed(segments)))
        # Of alike blocks that are computed together, some may be read and others not.
        several = {
            group.first_segment + i
            for group in self.plan.groups
            if len(group.uses) > 1
            for i in range(len(group.program.shapes))
        }
        return [
            pair
            for pair, place in places.items()
            if place.segment and (place.segment not in read or place.segment in several) and self._ranges(pair)
        ]

    def evaluate(self, t: Any, y: Any, inputs: Inputs, wanted: Sequence[Pair], also: Iterable[int] = ()) -> Store:
        """Compute the wanted pairs, and further segments.

        After the states, `y` may hold `memory`, from which iterations then start, and the discrete variables.
        """
        n, m = len(self.nominals), self.memory_size
        guess = self.guess(inputs) if len(y) == n else self._remembered(y[n : n + m])
        return self.plan.evaluate(y[:n], t, self.with_discrete(inputs, y).params, guess, wanted, also)

    @ft.cached_property
    def events(self) -> EventSet | None:
        """The events that components state."""
        return events_of(self.flat, self.time_leaves)

    @ft.cached_property
    def initial_equations(self) -> InitialEquations | None:
        """Those that components state."""
        return initial_equations_of(self.flat)

    @ft.cached_property
    def instants(self) -> EquationInstants:
        """The times at which equations change their law."""
        return equation_instants(self.flat, self.merged)

    @ft.cached_property
    def time_leaves(self) -> frozenset[int]:
        """The leaves that are the time."""
        leaf_of, timed = self.flat.leaf_of_node, self.merged.representative == TIME
        others = set(leaf_of[~timed | (self.merged.sign != 1)].tolist())
        return frozenset(set(leaf_of[timed].tolist()) - others)

    @ft.cached_property
    def discrete_places(self) -> dict[int, np.ndarray]:
        """Where the elements of the discrete leaves lie in the extended state vector, after states and memory."""
        places, start = {}, len(self.nominals) + self.memory_size
        for index in self.flat.discrete_leaves:
            leaf = self.flat.leaves[index]
            places[index] = start + np.arange(math.prod(leaf.stack + leaf.sizes))
            start += len(places[index])
        return places

    @property
    def extended_size(self) -> int:
        """The length of the state vector with the memory and the discrete variables that follow it."""
        return len(self.nominals) + self.memory_size + sum(len(places) for places in self.discrete_places.values())

    def discrete_values(self, y: Any, inputs: Inputs) -> dict[int, Any]:
        """The discrete leaves by number, from an extended state vector or else from the inputs."""
        start = len(self.nominals) + self.memory_size
        values = y[start : self.extended_size] if len(y) >= self.extended_size else inputs.discrete
        if values is None:
            return {}
        shapes = {i: self.flat.leaves[i].stack + self.flat.leaves[i].sizes for i in self.discrete_places}
        return {
            i: jax.lax.slice(values, (places[0] - start,), (places[-1] + 1 - start,)).reshape(shapes[i])
            for i, places in self.discrete_places.items()
        }

    def with_discrete(self, inputs: Inputs, y: Any) -> Inputs:
        """The inputs with the discrete variables that an extended state vector holds."""
        values = self.discrete_values(y, inputs)
        if not values:
            return inputs
        leaves = [values.get(i) for i in range(len(self.flat.leaves))]
        changed = {key: packed(self.flat, leaves, *key) for key in inputs.params if self._is_discrete(key)}
        return dataclasses.replace(inputs, params=inputs.params | changed)

    def _is_discrete(self, key: tuple[int, int]) -> bool:
        kind, slot = key
        return self.flat.holders[kind].kind.declarations[slot].role == "discrete"

    def collected(self, t: Any, y: Any, inputs: Inputs, pairs: Sequence[Pair]) -> Any:
        """The values of pairs as one flat vector."""
        return self.plan.collect(self.evaluate(t, y, inputs, pairs), pairs)

    def constrained_places(self, leaf: int) -> tuple[np.ndarray, np.ndarray]:
        """Where the elements of a leaf lie among the constrained pairs, and the signs with which they do.

        Raises `ModelError` where the leaf is an algebraic variable, which cannot be set.
        """
        flat_leaf, pairs = self.flat.leaves[leaf], self.constraints.pairs
        first = dict(zip(pairs, np.cumsum([0, *(self.plan.size(v) for v, _ in pairs)]).tolist(), strict=False))
        places, signs = [], []
        for i in range(flat_leaf.count):
            pair, sign = self.pair_of_node(flat_leaf.first + i)
            if pair not in first:
                raise ModelError(
                    f"An event sets {flat_leaf.name(i)}, which is neither a state nor tied to states by constraints: "
                    "its value follows from an equation. Change what that equation depends on."
                )
            assert pair is not None
            size = self.plan.size(pair[0])
            places.append(first[pair] + np.arange(size))
            signs.append(np.full(size, sign))
        return np.concatenate(places), np.concatenate(signs)

    @ft.cached_property
    def memory(self) -> list[Pair]:
        """The unknowns that are iterated for, and whose last values are good guesses."""
        if self.solved is not None:
            return []
        return [self.ordered.unknowns[u] for torn in self.torn if torn.kind == "nonlinear" for u in torn.tears]

    @property
    def memory_size(self) -> int:
        return self.plan_size(self.memory)

    def _remembered(self, values: Any) -> Any:
        sizes = [self.plan.size(v) for v, _ in self.memory]
        first = dict(zip(self.memory, np.cumsum([0, *sizes]).tolist(), strict=False))

        def guess(pairs: Sequence[Pair]) -> Any:
            index = np.array([first[pair] + np.arange(self.plan.size(pair[0])) for pair in pairs])
            return values[index].reshape(len(pairs), *self.plan.shapes[pairs[0][0]])

        return guess

    def with_memory(self, t: Any, y: Any, inputs: Inputs) -> Any:
        """`y`, which may end in the memory of an earlier point, with that of this one."""
        if not self.memory:
            return y
        n, m = len(self.nominals), self.memory_size
        new = self.collected(t, y, inputs, self.memory)
        new = new if len(y) == n else jnp.where(jnp.isfinite(new), new, y[n : n + m])
        return jnp.concatenate([y[:n], jax.lax.stop_gradient(new), y[n + m :]])

    @ft.cached_property
    def _invariant_groups(self) -> list[Group]:
        rows = sorted(self.ordered.invariants)
        return self.plan.residual_groups(residual_programme(self.ordered, [row], self.kind_index) for row in rows)

    def missed_invariants(self, t: Any, y: Any, inputs: Inputs) -> Any:
        """The invariants as functions of the state vector, zero where they hold."""
        also = {segment for group in self._invariant_groups for segment in group.depends}
        store = self.evaluate(t, y, inputs, [], also)
        parts = [jnp.ravel(r) for group in self._invariant_groups for r in group_residuals(group, store, inputs.params)]
        return jnp.concatenate(parts) if parts else jnp.zeros(0)

    def projected(self, t: Any, y: Any, inputs: Inputs) -> Any:
        """The state vector moved onto the invariants; it has drifted by no more than an error of integration."""
        if not self.ordered.invariants:
            return y
        invariants = self.invariants
        x = self.collected(t, y, inputs, invariants.pairs)
        moved = invariants.projected(x, invariants.weights(), t, inputs.params)
        return placed(y, invariants.in_state_vector, moved[invariants.states])

    def evaluate_all(self, t: Any, y: Any, inputs: Inputs) -> Store:
        """All unknowns at a point, outputs that feed no state included."""
        return self.evaluate(t, y, inputs, list(self.plan.places))

    def first_not_finite(self, t: Any, y: Any, inputs: Inputs) -> Pair | None:
        """The first unknown, in the order of computation, that is not finite at a point; for messages."""
        store = self.evaluate_all(t, y, inputs)
        for pair, place in self.plan.places.items():
            value = store.flat(place.segment)[place.start : place.start + self.plan.size(pair[0])]
            if not np.all(np.isfinite(np.asarray(value))):
                return pair
        return None

    def block_of(self, pair: Pair) -> Torn | None:
        """The simultaneous block that a pair is solved in; None where it is not."""
        unknowns = self.ordered.unknowns
        return next((torn for torn in self.torn if torn.tears and pair in [unknowns[u] for u in torn.unknowns]), None)

    @property
    def root_fields(self) -> tuple[str, ...]:
        """Names of the model's own parts, parameters and variables."""
        return tuple(dict.fromkeys(leaf.path.partition(".")[0].partition("[")[0] for leaf in self.flat.leaves))

    def guess(self, inputs: Inputs) -> Any:
        """Start values for non-linear solves, by (variable, order) pair; zero for a derivative."""

        def guess(pairs: Sequence[Pair]) -> Any:
            return self.start_values(inputs, pairs).reshape(len(pairs), *self.plan.shapes[pairs[0][0]])

        return guess

    def start_values(self, inputs: Inputs, pairs: Sequence[Pair]) -> Float[Array, " elements"]:
        """The start values of pairs one after the other; zero for a derivative."""
        return self._without_rates(self.starts.values(inputs, self._nodes(pairs)), pairs)

    def start_spreads(self, inputs: Inputs, pairs: Sequence[Pair]) -> Float[Array, " elements"]:
        """How far apart the start values are that are given for the aliases of pairs; zero for a derivative."""
        return self._without_rates(self.starts.spreads(inputs, self._nodes(pairs)), pairs)

    def _without_rates(self, values: Any, pairs: Sequence[Pair]) -> Any:
        is_rate = np.repeat([k > 0 for _, k in pairs], [self.plan.size(v) for v, _ in pairs]).astype(bool)
        return jnp.where(is_rate, 0.0, values) if np.any(is_rate) else values

    def _nodes(self, pairs: Sequence[Pair]) -> list[int]:
        return [int(self.ordered.table.variables[v]) for v, _ in pairs]

    @ft.cached_property
    def starts(self) -> Starts:
        return Starts(self.flat, self.merged)

    def pair_of_node(self, node: int) -> tuple[Pair | None, int]:
        """The pair whose value a node has, up to the sign returned; None with sign 0 for zero, with sign 1 for time."""
        representative, sign = int(self.merged.representative[node]), int(self.merged.sign[node])
        if representative == ZERO:
            return None, 0
        if representative == TIME:
            return None, 1
        return (self.ordered.table.number_of_node[representative], 0), sign


def _is_admitted(leaf: FlatLeaf, start: Any) -> Any:
    """Whether each element of a start value is one that the variable can have."""
    sign, is_finite = leaf.declaration.sign, abs(start) < np.inf
    return is_finite if sign is None else is_finite & sign.admits(start)


def _needed(leaf: FlatLeaf) -> str:
    sign = leaf.declaration.sign
    return f"{leaf.path} must be {sign.name if sign else 'a finite number'}"


def _bad_start(leaf: FlatLeaf, start: np.ndarray) -> str:
    return f"{_needed(leaf)}, but starts from {start if start.size > 1 else start.ravel()[0]} {leaf.declaration.unit}."
