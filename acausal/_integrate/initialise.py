"""`initialise`: start values from conditions on any variable and its derivative, or from rest."""

import dataclasses
import functools as ft
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from .._declare.component import Component, Equation
from .._declare.layout import complete_leaves, with_leaves
from .._errors import ModelError, SimulationError, listed, suggestion
from .._evaluate.constraints import CLOSE
from .._evaluate.initial import constrained_names, given_pairs, start_point
from .._evaluate.observe import observe, observe_with_rates
from .._evaluate.starts import Inputs
from .._evaluate.system import System
from .._tracing import is_traced
from .quantity import Quantity, trace
from .search import RANK, Found, find_start
from .simulate import system_of

M = TypeVar("M", bound=Component)
Conditions = Callable[[Any, Any], Mapping[str, Equation]]


@dataclasses.dataclass(frozen=True)
class Problem:
    """What a search for start values is compiled for."""

    system: System
    conditions: Quantity | None
    names: tuple[str, ...]  # of the conditions
    steady: bool
    given: frozenset[int]
    fixed: frozenset[int]  # those of the given ones that must not move
    wanted: tuple[int, ...]  # the leaves that get start values


def initialise(
    model: M,
    conditions: Conditions | None = None,
    *,
    steady: bool = False,
    free: Sequence[str] | Literal["all"] | None = None,
    easier: M | None = None,
    t0: Any = 0.0,
    strict: bool = False,
    throw: bool = True,
) -> M:
    """The model with start values that satisfy conditions; `simulate` it, or linearise it there.

    - `conditions(s, d)`: a dictionary of named equations, as in `dict(held=eq(s.rod.f, 300.0), rest=eq(d.pump.w))`,
      between any variables (`s`) and their time derivatives (`d`), both in the shape of the model.
    - `steady`: all states are at rest, their derivatives zero.
    - `free`: names of start values in the model that are only guesses, or "all". By default all of them where `steady`,
      else none: start values that are given are kept.
    - `easier`: the same model with other parameters, for which the search is easier: its solution is followed while the
      parameters change to those of `model` (a homotopy), should the direct search fail. Without it, what the conditions
      lack at the first guess is taken away bit by bit.
    - `strict`: raise where the conditions leave a state undetermined. Otherwise what they leave open stays near its
      start value.

    The nearest solution to the start values is found by Levenberg and Marquardt's method, in nominal sizes. It is
    differentiable in both modes by the implicit function theorem, and works under `jit` and `vmap`.

    Raises `ModelError` for names that do not exist and `SimulationError` where no start is found, naming the conditions
    that contradict each other; with `throw=False` the start values are then NaN.
    """
    system = system_of(model)
    leaves, _ = complete_leaves(model)
    problem, constants = _problem(system, leaves, conditions, steady, free)
    params = system.enforced(system.parameters(leaves))
    easy = params if easier is None else system.enforced(system.parameters(complete_leaves(easier)[0]))
    starts = system.starts.pack(leaves)
    found, values = _solve(problem, params, easy, starts, jnp.asarray(t0, float), constants)
    if not is_traced(found.violation):
        _report(problem, found, strict=strict, throw=throw)
    new = dict(zip(problem.wanted, values, strict=True))
    return with_leaves(model, [new.get(i, leaf) for i, leaf in enumerate(leaves)])


def _problem(
    system: System, leaves: list[Any], conditions: Conditions | None, steady: bool, free: Any
) -> tuple[Problem, list[Any]]:
    quantity, constants, names = None, [], ()
    if conditions is not None:
        stated = ft.partial(_residuals, conditions)
        quantity, constants = trace(stated, system.flat, "conditions", n_views=2)
        names = tuple(jax.tree_util.tree_unflatten(quantity.tree, range(quantity.n_outputs)))
    given = system.given(leaves)
    return (
        Problem(
            system, quantity, names, steady, given, given - _free(system, given, steady, free), _wanted(system, given)
        ),
        constants,
    )


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
    paths = {leaf.path: i for i, leaf in enumerate(system.flat.leaves) if i in system.variable_leaves}
    for name in free:
        if name not in paths:
            raise ModelError(f"free: the model has no variable {name!r}.{suggestion(name, paths)}")
    return frozenset(paths[name] for name in free)


def _wanted(system: System, given: frozenset[int]) -> tuple[int, ...]:
    """The leaves from which a run starts at the point found: those of the states, or where that is not enough, of all
    that constraints tie to them; those that iterations start from; and those that are given already."""
    table = system.ordered.table
    enough = not system.ordered.invariants and all(order == 0 for _, order in system.states)
    pairs = [*(system.states if enough else system.constraints.pairs), *system.memory]
    nodes = [int(table.variables[v]) for v, order in pairs if order == 0]
    return tuple(sorted({int(system.flat.leaf_of_node[node]) for node in nodes} | given))


@ft.partial(jax.jit, static_argnums=0)
def _solve(
    problem: Problem, params: list[Any], easy: list[Any], starts: Any, t0: Any, constants: list[Any]
) -> tuple[Found, list[Any]]:
    system, constraints = problem.system, problem.system.constraints
    inputs = Inputs(system.pack_params(params), jnp.asarray(starts), problem.given)
    easy_inputs = Inputs(system.pack_params(easy), inputs.starts, problem.given)
    fixed = given_pairs(system, dataclasses.replace(inputs, given=problem.fixed))
    weight = constraints.weights(fixed, 0.0)

    def residual(x: Any, numbers: Any) -> Any:
        inputs, params, t0 = numbers
        return jnp.concatenate(
            [constraints.residuals(x, t0, inputs.params), _lack(problem, x, t0, inputs, params, constants)]
        )

    found = find_start(
        residual, start_point(system, inputs), (inputs, params, t0), (easy_inputs, easy, t0), constraints.sizes, weight
    )
    y = found.x[constraints.states]
    return found, observe(system, t0, y, inputs, problem.wanted)


def _lack(problem: Problem, x: Any, t0: Any, inputs: Inputs, params: list[Any], constants: list[Any]) -> Any:
    """What the conditions are short of."""
    system = problem.system
    y = x[system.constraints.states]
    parts = []
    if problem.steady:
        parts.append(system.vector_field(t0, y, inputs))
    if problem.conditions is not None:
        n = len(system.flat.leaves)
        wanted = [i for i in problem.conditions.leaves if i % n in system.variable_leaves]
        values, rates = observe_with_rates(system, t0, y, inputs, sorted({i % n for i in wanted}))
        read = [
            params[i] if i < n and i not in system.variable_leaves else (values if i < n else rates)[i % n]
            for i in problem.conditions.leaves
        ]
        parts.append(jnp.stack(problem.conditions(constants, read)))
    return jnp.concatenate(parts) if parts else jnp.zeros(0)


def _report(problem: Problem, found: Found, *, strict: bool, throw: bool) -> None:
    system = problem.system
    if not throw or np.ndim(found.violation):
        return
    if not found.violation <= CLOSE:
        raise SimulationError(_contradiction(problem, found))
    if strict:
        _check_determined(system, found, given_pairs(system, Inputs({}, jnp.zeros(0), problem.fixed)))


def _contradiction(problem: Problem, found: Found) -> str:
    """Which conditions are not met, and with which others they clash."""
    names = _names(problem)
    residual, slopes = np.asarray(found.residual), np.asarray(found.slopes)
    if not np.all(np.isfinite(residual)) or not np.all(np.isfinite(slopes)):
        bad = [name for name, value in zip(names, residual, strict=True) if not np.isfinite(value)]
        return (
            f"No start values were found: {listed(bad or names)} became infinite or not a number. Remedy: better "
            "first guesses, as start values with free=[...], or an `easier` model to start from."
        )
    missed = [names[i] for i in np.argsort(-np.abs(residual)) if abs(residual[i]) > CLOSE]
    lines = [f"No start values satisfy the conditions. Not met: {listed(missed)}."]
    left, sizes, _ = np.linalg.svd(slopes)
    rank = int(np.sum(sizes > RANK * max(sizes, default=0.0)))
    clashes = [vector for vector in left.T[rank:] if abs(vector @ residual) > CLOSE]
    for vector in clashes:
        lines.append(f"  These depend on each other and contradict: {listed([names[i] for i in _large(vector)])}.")
    lines.append(
        "  Remedy: remove one of the conditions, or let start values move that are given"
        + (f" (free=[...]): {listed(_given_names(problem))}." if problem.fixed else ".")
        if clashes
        else "  Remedy: better first guesses, as start values with free=[...], or an `easier` model to start from."
    )
    return "\n".join(lines)


def _names(problem: Problem) -> list[str]:
    """Of the residuals that are searched to vanish."""
    system = problem.system
    steady = (
        [
            f"der({name}) = 0"
            for name in [
                system.ordered.table.variable_name(*pair)
                for pair in system.states
                for _ in range(system.plan.size(pair[0]))
            ]
        ]
        if problem.steady
        else []
    )
    return [*system.constraints.names, *steady, *problem.names]


def _given_names(problem: Problem) -> list[str]:
    return [problem.system.flat.leaves[i].path for i in sorted(problem.fixed)]


def _check_determined(system: System, found: Found, fixed: np.ndarray) -> None:
    slopes = np.asarray(found.slopes)[:, ~fixed]
    _, sizes, right = np.linalg.svd(slopes)
    rank = int(np.sum(sizes > RANK * max(sizes, default=0.0)))
    names = [name for name, is_fixed in zip(constrained_names(system), fixed, strict=True) if not is_fixed]
    is_state = system.constraints.is_state[~fixed]
    open_ones = {names[i] for vector in right[rank:] for i in _large(np.where(is_state, vector, 0.0))}
    if open_ones:
        raise SimulationError(
            f"The conditions leave {len(right) - rank} of the start values undetermined, among these variables: "
            f"{listed(sorted(open_ones))}. Remedy: give their start values, add conditions, or leave out strict=True "
            "to keep them where they are."
        )


def _large(vector: np.ndarray) -> np.ndarray:
    return np.flatnonzero(np.abs(vector) > 0.05 * np.max(np.abs(vector), initial=0.0))
