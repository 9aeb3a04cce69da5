"""The start value problem: its conditions, and which numbers of a model are free."""

import dataclasses
import functools as ft
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import PyTree

from ..._declare.component import Equation
from ..._errors import ModelError, suggestion
from ..._evaluate.groups import ModelParameters
from ..._evaluate.initial import given_pairs, given_unknowns, lack_of_given, pair_names
from ..._evaluate.observe import observe_with_rates
from ..._evaluate.starts import Inputs
from ..._evaluate.system import System
from ..._numbers import Numbers
from ..._reduce.incidence import Pair
from ..setup.expressions import check_units_of
from ..setup.options import names_of
from ..setup.user_function import DERIVATIVES, VARIABLES, UserFunction, as_function, trace
from .trim import Trim

Conditions = Callable[[PyTree, PyTree], Mapping[str, Equation]]


class Values(NamedTuple):
    """The numbers of a search: those of the model, the time, the constants in the conditions, and the sizes of the
    unknown parameters.
    """

    inputs: Inputs
    t0: Array
    constants: list[Numbers]
    sizes: Array

    def in_modes(self, system: System, discrete: Array | None) -> "Values":
        """A copy with these values of the discrete variables, in a flat array."""
        if not system.carried.discrete_places:
            return self
        inputs = dataclasses.replace(self.inputs, discrete=discrete)
        return self._replace(inputs=system.carried.with_discrete(inputs, jnp.zeros(0)))

    def at(self, trim: Trim, x: Array) -> "Values":
        """A copy with the parameters taken from the unknowns x."""
        return self._replace(inputs=trim.applied(x, self.sizes, self.inputs))


@dataclasses.dataclass(frozen=True)
class Problem:
    """Static description of a search for start values."""

    system: System
    conditions: UserFunction | None
    names: tuple[str, ...]  # of the conditions
    rests: tuple[int, ...]  # elements of the state vector whose derivatives must be zero
    given: frozenset[int]
    fixed: frozenset[int]  # given start values that must not change
    wanted: tuple[int, ...]  # leaves that receive start values
    given_unknowns: tuple[Pair, ...]  # algebraic unknowns with fixed start values
    strict: bool
    trim: Trim  # unknown parameters

    @property
    def of_components(self) -> "Problem":
        """The same problem with only the initial equations of components as conditions."""
        return dataclasses.replace(
            self, conditions=None, names=(), rests=(), given_unknowns=(), strict=False, trim=Trim(self.system, ())
        )

    @property
    def held(self) -> np.ndarray:
        """Mask of the elements of the constrained pairs whose start values are fixed."""
        return given_pairs(self.system, Inputs(ModelParameters(), jnp.zeros(0), self.fixed))

    @property
    def foreign(self) -> np.ndarray:
        """Mask of the elements that are states not owned by components with initial equations."""
        system, initial = self.system, self.system.initial_equations
        leaves = () if initial is None else initial.own()
        own = _tied(system, {pair for leaf in leaves for pair in _pairs_of(system, leaf)})
        sizes = [system.plan.size(variable) for variable, _ in system.constraints.pairs]
        is_own = np.repeat([pair in own for pair in system.constraints.pairs], sizes).astype(bool)
        return system.constraints.is_state & ~is_own

    def residual(self, x: Array, values: Values) -> Array:
        """The residuals at x: those of the constraints between its elements and those of the conditions."""
        constraints, values, x = self.system.constraints, values.at(self.trim, x), self.trim.own(x)
        return jnp.concatenate([constraints.residuals(x, values.t0, values.inputs.params), self._lack(x, values)])

    def _lack(self, x: Array, values: Values) -> Array:
        system, (inputs, t0, constants, _) = self.system, values
        params = inputs.params.leaves
        y, initial = x[system.constraints.states], system.initial_equations
        observed, rates = {}, {}
        parts = [jnp.zeros(0)]
        if self.rests:
            parts.append(system.vector_field(t0, y, inputs)[np.array(self.rests)])
        leaves, moving = self._read
        if leaves or moving:
            observed, rates = observe_with_rates(system, t0, y, inputs, leaves, moving)
        if initial is not None:
            parts.append(initial.residuals(params, observed, rates))
        if self.given_unknowns:
            parts.append(lack_of_given(system, t0, y, inputs, self.given_unknowns))
        if self.conditions is not None and self.names:
            n = len(system.flat.own_leaves)
            read = [
                rates[i - n] if i >= n else observed[i] if i in observed else params[i] for i in self.conditions.leaves
            ]
            parts.append(jnp.stack(self.conditions(constants, read)))
        return jnp.concatenate(parts)

    @property
    def _read(self) -> tuple[list[int], list[int]]:
        """The variables whose values are needed, and those whose derivatives are needed."""
        system, initial, n = self.system, self.system.initial_equations, len(self.system.flat.own_leaves)
        read = () if self.conditions is None else self.conditions.leaves
        values, rates = {i for i in read if i < n and system.flat.is_variable(i)}, {i - n for i in read if i >= n}
        if initial is not None:
            values, rates = values | initial.variables, rates | initial.rates
        return sorted(values), sorted(rates)

    @property
    def residual_names(self) -> list[str]:
        """The names of the residuals, in the order of `residual`."""
        system, names = self.system, self.system.element_names
        initial = [] if system.initial_equations is None else system.initial_equations.names
        unknowns = [f"the start value of {name}" for name in pair_names(system, self.given_unknowns)]
        rests = [f"der({names[i]}) = 0" for i in self.rests]
        return [*system.constraints.names, *rests, *initial, *unknowns, *self.names]

    @property
    def rest_names(self) -> dict[int, str]:
        """The states that must be at rest, by the index of the residual of their rates."""
        names = self.system.element_names
        return {len(self.system.constraints.names) + i: names[place] for i, place in enumerate(self.rests)}


def problem_of(
    system: System,
    leaves: list[Numbers | None],
    conditions: Conditions | None = None,
    *,
    steady: bool = False,
    moving: Sequence[str] = (),
    free: object = None,
    strict: bool = False,
    trimmed: tuple[int, ...] = (),
) -> tuple[Problem, list[Numbers]]:
    """The problem that `initialise` solves, and the constants in its conditions. By default, the conditions are the
    initial equations of components.
    """
    quantity, constants, names = None, [], ()
    if conditions is not None:
        checks: dict[str, bool] = {}
        function = as_function(conditions, "conditions", (VARIABLES, DERIVATIVES))
        quantity, constants = trace(ft.partial(_residuals, function, checks), system.flat, "conditions", n_views=2)
        names = tuple(jax.tree_util.tree_unflatten(quantity.tree, range(quantity.n_outputs)))
        checked = tuple(i for i, name in enumerate(names) if checks[name])
        check_units_of(quantity, system.flat, "conditions", checked)
    given = system.intake.given(leaves)
    fixed = given - _free(system, given, steady, free)
    rests = _rests(system, moving) if steady else ()
    if moving and not steady:
        raise ModelError("moving= exempts derivatives from steady=True, which is not set.")
    unknowns = tuple(given_unknowns(system, fixed))
    trim = Trim(system, trimmed)
    return Problem(
        system, quantity, names, rests, given, fixed, _wanted(system, given), unknowns, strict, trim
    ), constants


def _residuals(conditions: Conditions, checks: dict[str, bool], s: PyTree, d: PyTree) -> dict[str, Numbers]:
    stated = conditions(s, d)
    if not isinstance(stated, Mapping) or not all(isinstance(value, Equation) for value in stated.values()):
        raise ModelError("conditions must return a dictionary of equations, such as dict(rest=eq(d.load.w, 0.0)).")
    checks.update((name, equation.check_units) for name, equation in stated.items())
    return {name: equation.residual for name, equation in stated.items()}


def _free(system: System, given: frozenset[int], steady: bool, free: object) -> frozenset[int]:
    if free is None:
        free = "all" if steady else ()
    if free == "all":
        return given
    return frozenset(_leaf(system, name, "free") for name in names_of(free, "free"))


def _leaf(system: System, name: str, what: str) -> int:
    """The number of a variable leaf by its path."""
    paths = {leaf.path: i for i, leaf in enumerate(system.flat.leaves) if leaf.declaration.is_variable}
    if name not in paths:
        raise ModelError(f"{what}: the model has no variable {name!r}.{suggestion(name, paths)}")
    return paths[name]


def _rests(system: System, moving: Sequence[str]) -> tuple[int, ...]:
    """The elements of the state vector, except those of moving variables."""
    moves = {pair for name in names_of(moving, "moving") for pair in _states_of(system, name)}
    sizes = [system.plan.size(variable) for variable, _ in system.states]
    is_at_rest = np.repeat([pair not in moves for pair in system.states], sizes)
    return tuple(np.flatnonzero(is_at_rest).tolist())


def _states_of(system: System, name: str) -> set[Pair]:
    """The states that a variable equals or is tied to by constraints. The variable is given by its path."""
    pairs = _tied(system, _pairs_of(system, _leaf(system, name, "moving")))
    found = {state for state in system.states if state in pairs}
    if not found:
        raise ModelError(
            f"moving: {name} is not tied to a state by constraints alone. Name one of the states: "
            f"{', '.join(system.state_names) or 'there is none'}."
        )
    return found


def _pairs_of(system: System, leaf: int) -> set[Pair]:
    """The pairs that hold the values of a variable leaf."""
    pairs = {system.pair_of_node(node)[0] for node in system.flat.leaves[leaf].nodes}
    return {pair for pair in pairs if pair is not None}


def _tied(system: System, pairs: set[Pair]) -> set[Pair]:
    """The pairs, and all pairs that constraints tie to them."""
    uses = [use for group in system.constraints.groups for use in group.uses]
    return pairs.union(*(use.values for use in uses if not pairs.isdisjoint(use.values)))


def _wanted(system: System, given: frozenset[int]) -> tuple[int, ...]:
    """The leaves that need start values for a run to start at the point found: those of the states or, if these are not
    enough, of all constrained pairs; those with initial guesses of iterations; and those given already."""
    table = system.ordered.table
    enough = not system.ordered.invariants and all(order == 0 for _, order in system.states)
    pairs = [*(system.states if enough else system.constraints.pairs), *system.carried.memory]
    nodes = [int(table.variables[v]) for v, order in pairs if order == 0]
    return tuple(sorted({int(system.flat.leaf_of_node[node]) for node in nodes} | given))
