"""Consistent start values: the point that satisfies the constraints and honours the start values that are given."""

import functools as ft
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .._reduce.states import nominal_of
from .._tracing import is_traced
from .blocks import NEWTON, row_scale, scaled_root
from .plan import Pair, Plan, Store, group_residuals
from .program import residual_programme
from .system import Inputs, System

# How much less than a dependent variable a state yields to the constraints, and a start value that is given.
STATE, GIVEN = 1e-6, 1e-12
TOLERANCE = 1e-6  # relative disagreement, of nominal size, at which start values contradict each other


def initial_state(system: System, t0: Any, inputs: Inputs, *, plain: bool) -> tuple[Any, Any]:
    """The state vector to start from, and for each of `constrained_names` whether its start value is contradicted.

    A start value of zero counts as not given. States keep their start values, unless values are given for variables
    that depend on them through constraints g(x) = 0: then the start is the nearest point x0 + D g_x(x0)^T m (to first
    order), with m such that g = 0, where D lets dependent variables move freely, states only where they must, and given
    values not at all if there is another way. `plain` says that no such value is given; see `is_plain`.
    """
    if plain or not system.ordered.constrained:
        return _with_algebraic(system, t0, _starts_of(system, inputs, system.states), inputs), jnp.zeros(0, bool)
    x0 = _starts_of(system, inputs, system.ordered.constrained)
    given, scale, places = x0 != 0, _sizes(system), _places(system)
    x = x0
    if system.ordered.constraints:
        dependent = np.setdiff1d(np.arange(len(scale)), places)
        needed = jnp.any(given[dependent]) | jnp.any(~jnp.isfinite(x0))
        x = jax.lax.cond(needed, lambda: _consistent(system, t0, inputs, x0, given), lambda: x0)
    moved = given & ~(jnp.abs(x - x0) <= TOLERANCE * (scale + jnp.abs(x0)))
    torn = _disagreement(system, inputs) > TOLERANCE * scale
    bad = jnp.where(jnp.any(moved), moved, torn | ~jnp.isfinite(x))
    return _with_algebraic(system, t0, x[places], inputs), bad


def _starts_of(system: System, inputs: Inputs, pairs: Sequence[Pair]) -> Any:
    parts = [jnp.ravel(system.guess(inputs)([pair])) for pair in pairs]
    return jnp.concatenate(parts) if parts else jnp.zeros(0)


def is_plain(system: System, starts: Any) -> bool:
    """Whether the start values are known, and those given are all of states and agree among aliases."""
    if is_traced(starts):
        return False
    numbers = np.asarray(starts)
    given = [variable for variable, places in _start_places(system) if np.any(numbers[places])]
    states = {variable for variable, _ in system.states}
    return all(v in states and not np.any(system.start_spread(Inputs({}, jnp.asarray(numbers)), v)) for v in given)


@ft.lru_cache(maxsize=64)
def _start_places(system: System) -> list[tuple[int, np.ndarray]]:
    """Where the start values of the aliases of each constrained variable lie in the vector of all."""
    variables = [variable for variable, order in system.ordered.constrained if order == 0]
    return [(v, system.starts.places(int(system.ordered.table.variables[v]))) for v in variables]


def _with_algebraic(system: System, t0: Any, y: Any, inputs: Inputs) -> Any:
    """The states, followed by the algebraic unknowns of the mass-matrix form, solved for at the start."""
    if system.solved is None:
        return y
    plan = system.solved.plan
    store = plan.evaluate(y, t0, inputs.params, system.guess(inputs), system.algebraic)
    return jnp.concatenate([y, plan.collect(store, system.algebraic)])


def constrained_names(system: System) -> list[str]:
    """The variable behind each element of what `initial_state` checks."""
    table, size = system.ordered.table, system.plan.size
    return [table.variable_name(*pair) for pair in system.ordered.constrained for _ in range(size(pair[0]))]


def _disagreement(system: System, inputs: Inputs) -> Any:
    """How far apart the start values given for variables that are the same are."""
    parts = []
    for variable, order in system.ordered.constrained:
        spread = system.start_spread(inputs, variable) if order == 0 else jnp.zeros(system.plan.shapes[variable])
        parts.append(jnp.ravel(spread))
    return jnp.concatenate(parts)


def _places(system: System) -> np.ndarray:
    """Where the elements of the states lie among those of the constrained pairs."""
    pairs = system.ordered.constrained
    starts = np.concatenate([[0], np.cumsum([system.plan.size(v) for v, _ in pairs])])
    first = dict(zip(pairs, starts.tolist(), strict=False))
    places = [first[state] + np.arange(system.plan.size(state[0])) for state in system.states]
    return np.concatenate(places) if places else np.zeros(0, int)


def _consistent(system: System, t0: Any, inputs: Inputs, x0: Any, given: Any) -> Any:
    """Two projections: from the result of the first, given values put back, the second moves them no further."""

    def project(x: Any, _: None) -> tuple[Any, None]:
        return _projected(system, t0, inputs, jnp.where(given, x0, x), given), None

    return jax.lax.scan(project, x0, None, length=2)[0]


def _projected(system: System, t0: Any, inputs: Inputs, x0: Any, given: Any) -> Any:
    """The consistent point, in variables measured in their nominal sizes."""
    scale = _sizes(system)
    is_state = np.isin(np.arange(len(scale)), _places(system))
    weight = jnp.where(jax.lax.stop_gradient(given), GIVEN, np.where(is_state, STATE, 1.0))
    plan = _constraint_plan(system)

    def constraints(x: Any, args: Any) -> Any:
        time, params = args
        store = Store(scale * x, time)
        parts = [jnp.ravel(r) for group in plan.groups for r in group_residuals(group, store, params)]
        return jnp.concatenate(parts)

    start, args = x0 / scale, (jnp.asarray(t0, float), inputs.params)
    slopes = jax.jacfwd(constraints)(start, args)
    directions = weight[:, None] * slopes.T
    rows = row_scale(jax.lax.stop_gradient(slopes))
    # A multiplier of 1 changes its own constraint by the size of its row, and to first order no other one.
    basis = directions @ jnp.linalg.solve(slopes @ directions, jnp.diag(rows))

    def along(multipliers: Any, args: Any) -> Any:
        start, basis, rest = args
        return constraints(start + basis @ multipliers, rest)

    multipliers = scaled_root(along, jnp.zeros(basis.shape[1]), (start, basis, args), rows, NEWTON)
    return scale * (start + basis @ multipliers)


def _sizes(system: System) -> np.ndarray:
    """Nominal sizes of the elements of the constrained pairs."""
    table, size = system.ordered.table, system.plan.size
    return np.concatenate([np.full(size(v), nominal_of(table, (v, 0))) for v, _ in system.ordered.constrained])


@ft.lru_cache(maxsize=64)
def _constraint_plan(system: System) -> Plan:
    ordered = system.ordered
    uses = [(0, residual_programme(ordered, row, system.kind_index)) for row in ordered.constraints]
    return Plan(uses, ordered.constrained, system.plan.shapes)
