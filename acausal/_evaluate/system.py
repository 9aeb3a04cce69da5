"""The result of the structural passes: a system of ordinary differential equations, other unknowns being explicit."""

import dataclasses
import functools as ft
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._declare.component import Component
from .._errors import ModelError, listed
from .._numbers import Numbers, Truth
from .._reduce.aliases import TIME, ZERO, Merged
from .._reduce.flat_model import FlatModel
from .._reduce.incidence import Pair, Ranges, is_within, ranges_of_pair
from .._reduce.index import Reduced
from .._reduce.sort import Sorted
from .._reduce.states import Chosen, nominal_of
from .._reduce.tear import Torn
from .carried import Carried
from .constraints import Constraints, all_constraints, invariants_of
from .equation_instants import EquationInstants, equation_instants
from .event_set import EventSet
from .events import events_of, time_leaves
from .groups import Group, Guess, Segments, group_residuals
from .initial_equations import InitialEquations, initial_equations_of
from .intake import Intake, ModelRequirements
from .plan import Plan
from .program import residual_program_of
from .starts import Inputs, PairStarts, Starts


@dataclasses.dataclass(eq=False, repr=False)
class System:
    """A model's equations, reduced and sorted; made by `choose_states` or, behind the scenes, by `simulate`.

    The state vector `y` holds the `states` in sequence, each a (variable, derivative order) pair. In mass-matrix
    form, `algebraic` unknowns follow, the tearing variables of all simultaneous blocks, whose equations are
    left to the integrator: M dy/dt = f(t, y), with zeros in `mass` for them. `solved` is then the ordinary form.

    The system evaluates the equations. `intake` converts numbers, `starts` gives initial guesses, and
    `carried` describes the augmented state of a run.
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
    made: tuple[Callable[..., "System"], tuple[object, ...]]  # the function that built it, and its arguments
    solved: "System | None" = None

    @property
    def name(self) -> str:
        """The class of the model."""
        return self.flat.name

    def __repr__(self) -> str:
        size = f"{len(self.states)} states, {len(self.torn)} blocks in {len(self.plan.groups)} groups"
        return f"<System of {self.name}: {size}>"

    def __reduce__(self) -> tuple[Callable[..., "System"], tuple[object, ...]]:
        # Traced equations cannot be stored; their source is stored instead.
        return read, (self.made, declared_by(self.flat))

    def __deepcopy__(self, memo: object) -> "System":
        return self

    def __copy__(self) -> "System":
        return self

    # The state vector

    @property
    def states(self) -> list[Pair]:
        """The states: the number of a variable, and the order of its derivative."""
        return self.ordered.states

    @ft.cached_property
    def state_names(self) -> list[str]:
        """The name of each state; an array state has one name."""
        return [self.ordered.table.variable_name(*state) for state in self.states]

    @property
    def element_names(self) -> list[str]:
        """The name of the state of each element of the state vector."""
        sizes = [self.plan.size(variable) for variable, _ in self.states]
        return [name for name, size in zip(self.state_names, sizes, strict=True) for _ in range(size)]

    @ft.cached_property
    def nominals(self) -> np.ndarray:
        """The nominal size of each element of the state vector."""
        return self.sizes_of([*((v, 0) for v, _ in self.states), *self.algebraic])

    def sizes_of(self, pairs: Sequence[Pair]) -> np.ndarray:
        """The nominal size of each element of pairs."""
        sizes = [np.full(self.plan.size(pair[0]), nominal_of(self.ordered.table, pair)) for pair in pairs]
        return np.concatenate([np.zeros(0), *sizes])

    @property
    def n_algebraic(self) -> int:
        """The number of elements of the algebraic unknowns."""
        return sum(self.plan.size(v) for v, _ in self.algebraic)

    @property
    def mass(self) -> np.ndarray | None:
        """The diagonal of the mass matrix; None for the identity."""
        n = len(self.nominals)
        return None if self.solved is None else np.where(np.arange(n) < n - self.n_algebraic, 1.0, 0.0)

    def pair_of_node(self, node: int) -> tuple[Pair | None, int]:
        """The pair with the value of a node, times the returned sign; None with sign 0 for zero, 1 for time."""
        representative, sign = int(self.merged.representative[node]), int(self.merged.sign[node])
        if representative == ZERO:
            return None, 0
        if representative == TIME:
            return None, 1
        return (self.ordered.table.number_of_node[representative], 0), sign

    # Numbers

    def pack(self, model: Component) -> Inputs:
        """Parameters by component class, and start values: the inputs of the compiled functions."""
        return self.intake.inputs(model)

    @ft.cached_property
    def intake(self) -> Intake:
        """The conversion of the numbers of a model."""
        requirements = ModelRequirements(self.flat)
        groups = self.plan.groups + self.residuals + self.constraints.groups
        used = {key for group in groups for key in group.program.params}
        used |= self.instants.keys | requirements.keys
        return Intake(self.flat, Starts(self.flat, self.merged), requirements, tuple(sorted(used)))

    @ft.cached_property
    def starts(self) -> PairStarts:
        """The initial guesses of unknowns."""
        return PairStarts(self.intake.starts, self.ordered.table, self.plan)

    @ft.cached_property
    def carried(self) -> Carried:
        """The layout of the augmented state of a run."""
        searched = [torn for torn in self.torn if torn.method == "nonlinear"] if self.solved is None else []
        memory = tuple(self.ordered.unknowns[u] for torn in searched for u in torn.tears)
        return Carried(self.flat, self.plan, len(self.nominals), memory)

    # Constraints, events and initial equations

    @ft.cached_property
    def constraints(self) -> Constraints:
        """The equations between variables below their highest derivatives, valid at every time."""
        return all_constraints(self.ordered, self.plan, self.kind_index)

    @ft.cached_property
    def constrained(self) -> frozenset[Pair]:
        """The variables below their highest derivatives, including the states."""
        return frozenset(self.ordered.constrained)

    @ft.cached_property
    def invariants(self) -> Constraints:
        """The constraints onto which the states of a run are projected."""
        return invariants_of(self.ordered, self.plan, self.kind_index)

    @ft.cached_property
    def events(self) -> EventSet | None:
        """The events of the components."""
        return events_of(self.flat, time_leaves(self.flat, self.merged))

    @ft.cached_property
    def initial_equations(self) -> InitialEquations | None:
        """The initial equations of the components."""
        return initial_equations_of(self.flat)

    @ft.cached_property
    def instants(self) -> EquationInstants:
        """The instants at which equations change their law."""
        return equation_instants(self.flat, self.merged)

    # Evaluation

    def vector_field(self, t: Numbers, y: Float[Array, " n"], inputs: Inputs) -> Float[Array, " n"]:
        """f of the reduced system M dy/dt = f(t, y), with `inputs` from `pack`."""
        return self.vector_field_and_store(t, y, inputs, [])[0]

    def vector_field_and_store(
        self, t: Numbers, y: Array, inputs: Inputs, wanted: Sequence[Pair], *, watch: bool = False
    ) -> tuple[Float[Array, " n"], Segments]:
        """The vector field, and the values computed for it and for further pairs.

        It is NaN if a variable that it depends on leaves its range; with `watch`, if any variable does.
        """
        watched = self._watched if watch else []
        store = self.evaluate(t, y, inputs, [*self.rates, *wanted, *watched], self._residual_segments)
        params = self.carried.with_discrete(inputs, y).params
        residuals = [jnp.ravel(r) for group in self.residuals for r in group_residuals(group, store, params)]
        rates = jnp.concatenate([self.plan.collect(store, self.rates), *residuals])
        if watched:
            inside = [jnp.all(is_within(self.plan.collect(store, [pair]), self._ranges(pair))) for pair in watched]
            rates = jnp.where(jnp.all(jnp.stack(inside)), rates, jnp.nan)
        return rates, store

    def evaluate(
        self,
        t: Numbers,
        y: Array,
        inputs: Inputs,
        wanted: Sequence[Pair],
        also: Iterable[int] = (),
        *,
        anew: Truth = False,
    ) -> Segments:
        """Compute the wanted pairs, and further segments.

        After the states, `y` may hold the `carried` values; iterations then start from the memory in it. If they fail
        and equations have changed their law, as after an event, they start `anew`, from the start values.
        """
        guess = self._guess(y, inputs, anew)
        params = self.carried.with_discrete(inputs, y).params
        return self.plan.evaluate(y[: len(self.nominals)], t, params, guess, wanted, also)

    def _guess(self, y: Array, inputs: Inputs, anew: Truth) -> Guess:
        first, last = self.starts.guess(inputs), self.carried.memory_of(y)
        if last is None:
            return first
        if anew is False:
            return last
        return lambda pairs: jnp.concatenate([last(pairs), jnp.where(anew, first(pairs), last(pairs))], axis=1)

    def evaluate_all(self, t: Numbers, y: Array, inputs: Inputs) -> Segments:
        """All unknowns at a point, including outputs that no state depends on."""
        return self.evaluate(t, y, inputs, list(self.plan.places))

    def collected(self, t: Numbers, y: Array, inputs: Inputs, pairs: Sequence[Pair], *, anew: Truth = False) -> Array:
        """The values of pairs as one flat vector."""
        return self.plan.collect(self.evaluate(t, y, inputs, pairs, anew=anew), pairs)

    def with_memory(self, t: Numbers, y: Array, inputs: Inputs, *, anew: Truth = False) -> Array:
        """`y`, possibly with the memory of an earlier point, with the memory of this one."""
        carried = self.carried
        if not carried.memory:
            return y
        n, end = carried.n_states, carried.n_states + carried.n_memory
        found = self.collected(t, y, inputs, carried.memory, anew=anew)
        found = found if len(y) == n else jnp.where(jnp.isfinite(found), found, y[n:end])
        return jnp.concatenate([y[:n], jax.lax.stop_gradient(found), y[end:]])

    @ft.cached_property
    def residuals(self) -> list[Group]:
        """The equations left to the integrator."""
        if self.solved is None:
            return []
        rows = [row for torn in self.torn for row in torn.residuals]
        return self.plan.residual_groups(residual_program_of(self.ordered, [row], self.kind_index) for row in rows)

    @property
    def rates(self) -> list[Pair]:
        """The derivatives of the states."""
        return [(variable, order + 1) for variable, order in self.states]

    @property
    def _residual_segments(self) -> set[int]:
        return {segment for group in self.residuals for segment in group.depends}

    def _ranges(self, pair: Pair) -> Ranges:
        return ranges_of_pair(self.ordered.table, pair)

    @ft.cached_property
    def _watched(self) -> list[Pair]:
        """The unknowns with ranges that no rate is sure to depend on."""
        places = self.plan.places
        read = self.plan.read_for(self._residual_segments | {places[pair].segment for pair in self.rates})
        return [
            pair for pair, place in places.items() if place.segment and place.segment not in read and self._ranges(pair)
        ]


Declared = tuple[tuple[Any, ...], ...]


def declared_by(flat: FlatModel) -> Declared:
    """The declarations of the numbers of a model, in order."""
    return tuple((leaf.path, leaf.declaration.role, leaf.declaration.unit, leaf.sizes) for leaf in flat.leaves)


def read(made: tuple[Any, tuple[Any, ...]], declared: Declared) -> Any:
    """The system rebuilt by a function from its arguments, if its classes still declare the same.

    Raises `ModelError` if they do not: the numbers stored with a system would be misinterpreted.
    """
    make, arguments = made
    system = make(*arguments)
    now = declared_by(system.flat)
    if now == declared:
        return system
    others = sorted({path for path, *_ in set(now) ^ set(declared)})
    what = (
        f"declare other parameters or variables, or other units: {listed(others)}" if others else "order them otherwise"
    )
    raise ModelError(f"The classes of {system.name} have changed since it was stored, and {what}.")
