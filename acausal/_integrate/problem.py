"""What start values are searched for: the conditions, and which of the numbers of a model may move."""

import dataclasses
import functools as ft
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .._declare.component import Component, Equation
from .._errors import ModelError, suggestion
from .._evaluate.observe import observe_with_rates
from .._evaluate.plan import Pair
from .._evaluate.starts import Inputs
from .._evaluate.system import System
from .quantity import Quantity, as_function, trace
from .trim import Trim, trimmed_leaves

Conditions = Callable[[Any, Any], Mapping[str, Equation]]


class Values(NamedTuple):
    """The numbers of a search: packed and by leaf, the time, those in the conditions, and the sizes of parameters that
    are searched for.
    """

    inputs: Inputs
    params: list[Any]
    t0: Any
    constants: list[Any]
    sizes: Any

    def in_modes(self, system: System, discrete: Any) -> "Values":
        """With these values of the discrete variables, one after the other."""
        if not system.discrete_places:
            return self
        inputs = dataclasses.replace(self.inputs, discrete=discrete)
        held = system.discrete_values(jnp.zeros(0), inputs)
        params = [held.get(i, leaf) for i, leaf in enumerate(self.params)]
        return self._replace(inputs=system.with_discrete(inputs, jnp.zeros(0)), params=params)

    def at(self, trim: Trim, x: Any) -> "Values":
        """With the parameters that are among the unknowns."""
        inputs, params = trim.applied(x, self.sizes, self.inputs, self.params)
        return self._replace(inputs=inputs, params=params)


@dataclasses.dataclass(frozen=True)
class Problem:
    """What a search for start values is compiled for."""

    system: System
    conditions: Quantity | None
    names: tuple[str, ...]  # of the conditions
    rests: tuple[int, ...]  # the elements of the state vector whose derivatives vanish
    given: frozenset[int]
    fixed: frozenset[int]  # those of the given ones that must not move
    wanted: tuple[int, ...]  # the leaves that get start values
    strict: bool
    trim: Trim  # the parameters that are searched for

    def residual(self, x: Any, values: Values) -> Any:
        """What is to vanish at x: the constraints between its elements, and what the conditions are short of."""
        constraints, values, x = self.system.constraints, values.at(self.trim, x), self.trim.own(x)
        return jnp.concatenate([constraints.residuals(x, values.t0, values.inputs.params), self._lack(x, values)])

    def _lack(self, x: Any, values: Values) -> Any:
        system, (inputs, params, t0, constants, _) = self.system, values
        y = x[system.constraints.states]
        parts = [jnp.zeros(0)]
        if self.rests:
            parts.append(system.vector_field(t0, y, inputs)[np.array(self.rests)])
        if self.conditions is not None:
            n = len(system.flat.leaves)
            wanted = [i for i in self.conditions.leaves if i % n in system.variable_leaves]
            seen, rates = observe_with_rates(system, t0, y, inputs, sorted({i % n for i in wanted}))
            read = [
                params[i] if i < n and i not in system.variable_leaves else (seen if i < n else rates)[i % n]
                for i in self.conditions.leaves
            ]
            parts.append(jnp.stack(self.conditions(constants, read)))
        return jnp.concatenate(parts)

    @property
    def residual_names(self) -> list[str]:
        """Of what is to vanish."""
        names = self.system.element_names
        return [*self.system.constraints.names, *(f"der({names[i]}) = 0" for i in self.rests), *self.names]


def problem_of(
    system: System,
    model: Component,
    leaves: list[Any],
    conditions: Conditions | None,
    *,
    steady: bool,
    moving: Sequence[str],
    free: Any,
    strict: bool,
    solve_for: Sequence[str],
) -> tuple[Problem, list[Any]]:
    """The problem that `initialise` is asked to solve, and the numbers in its conditions."""
    quantity, constants, names = None, [], ()
    if conditions is not None:
        quantity, constants = trace(
            ft.partial(_residuals, as_function(conditions, "conditions")), system.flat, "conditions", n_views=2
        )
        names = tuple(jax.tree_util.tree_unflatten(quantity.tree, range(quantity.n_outputs)))
    given = system.given(leaves)
    fixed = given - _free(system, given, steady, free)
    rests = _rests(system, moving) if steady else ()
    if moving and not steady:
        raise ModelError("moving= exempts derivatives from steady=True, which is not asked for.")
    trim = Trim(system, trimmed_leaves(model, solve_for))
    return Problem(system, quantity, names, rests, given, fixed, _wanted(system, given), strict, trim), constants


def _residuals(conditions: Conditions, s: Any, d: Any) -> dict[str, Any]:
    stated = conditions(s, d)
    if not isinstance(stated, Mapping) or not all(isinstance(value, Equation) for value in stated.values()):
        raise ModelError("conditions must return a dictionary of equations, such as dict(rest=eq(d.load.w, 0.0)).")
    return {name: equation.residual for name, equation in stated.items()}


def _free(system: System, given: frozenset[int], steady: bool, free: Any) -> frozenset[int]:
    if free is None:
        free = "all" if steady else ()
    if free == "all":
        return given
    return frozenset(_leaf(system, name, "free") for name in free)


def _leaf(system: System, name: str, what: str) -> int:
    """The number of a variable leaf by its path."""
    paths = {leaf.path: i for i, leaf in enumerate(system.flat.leaves) if i in system.variable_leaves}
    if name not in paths:
        raise ModelError(f"{what}: the model has no variable {name!r}.{suggestion(name, paths)}")
    return paths[name]


def _rests(system: System, moving: Sequence[str]) -> tuple[int, ...]:
    """The elements of the state vector but for those of variables that move."""
    moves = {pair for name in moving for pair in _states_of(system, name)}
    sizes = [system.plan.size(variable) for variable, _ in system.states]
    is_at_rest = np.repeat([pair not in moves for pair in system.states], sizes)
    return tuple(np.flatnonzero(is_at_rest).tolist())


def _states_of(system: System, name: str) -> set[Pair]:
    """The states that a variable is, or that constraints tie it to, by its path."""
    leaf = system.flat.leaves[_leaf(system, name, "moving")]
    pairs = {system.pair_of_node(leaf.first + i)[0] for i in range(leaf.count)}
    for group in system.constraints.groups:
        for use in group.uses:
            pairs |= set(use.values) if not pairs.isdisjoint(use.values) else set()
    found = {state for state in system.states if state in pairs}
    if not found:
        raise ModelError(
            f"moving: {name} is not tied to a state by constraints alone. Name one of the states: "
            f"{', '.join(system.state_names) or 'there is none'}."
        )
    return found


def _wanted(system: System, given: frozenset[int]) -> tuple[int, ...]:
    """The leaves from which a run starts at the point found: those of the states, or where that is not enough, of all
    that constraints tie to them; those that iterations start from; and those that are given already."""
    table = system.ordered.table
    enough = not system.ordered.invariants and all(order == 0 for _, order in system.states)
    pairs = [*(system.states if enough else system.constraints.pairs), *system.memory]
    nodes = [int(table.variables[v]) for v, order in pairs if order == 0]
    return tuple(sorted({int(system.flat.leaf_of_node[node]) for node in nodes} | given))
