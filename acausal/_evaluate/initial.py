"""Consistent start values: the point that satisfies the constraints and the given start values."""

from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._numbers import Numbers
from .._reduce.incidence import Pair
from .._tracing import is_traced
from .chained_starts import ChainedStarts
from .constraints import TOLERANCE, placed
from .given_unknowns import GivenUnknowns, given_unknowns
from .intake import LARGE
from .packing import ModelParameters
from .starts import Inputs
from .system import System


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
