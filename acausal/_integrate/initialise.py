"""`initialise`: start values from conditions on any variable and its derivative, or from rest."""

import functools as ft
from collections.abc import Sequence
from typing import Any, Literal, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from .._declare.component import Component
from .._declare.layout import complete_leaves, with_leaves
from .._errors import SimulationError, listed
from .._evaluate.constraints import CLOSE
from .._evaluate.initial import constrained_names, given_pairs, start_point
from .._evaluate.observe import observe
from .._evaluate.starts import Inputs
from .._tracing import is_traced
from .modes import modes_at
from .problem import Conditions, Problem, Values, problem_of
from .search import RANK, Found, Search
from .simulate import system_of
from .starting import refusal, start_of

OPEN = 1e-6  # freedom of a state from which on it counts as undetermined
M = TypeVar("M", bound=Component)


class _Outcome(NamedTuple):
    """What was found; the events that go on to happen there and those that are refused; and what is undetermined."""

    found: Found
    happen: Any
    refused: Any
    is_open: Any


def initialise(
    model: M,
    conditions: Conditions | None = None,
    *,
    steady: bool = False,
    free: Sequence[str] | Literal["all"] | None = None,
    moving: Sequence[str] = (),
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
    - `moving`: names of states whose derivatives need not vanish where `steady`, as the angle of a shaft that turns.
    - `easier`: the same model with other parameters, for which the search is easier: its solution is followed while the
      parameters change to those of `model` (a homotopy), should the direct search fail. Without it, what the conditions
      lack at the first guess is taken away bit by bit.
    - `strict`: raise where the conditions leave a state undetermined. Otherwise what they leave open stays near its
      start value.

    Switches, diodes, friction and whatever else changes by events is in the mode that the start values imply, past
    events have happened, and the model returned holds the discrete variables that were found.

    The nearest solution to the start values is found by Levenberg and Marquardt's method, in nominal sizes. It is
    differentiable to any order in both modes, as an implicit function, and works under `jit` and `vmap`.

    Raises `ModelError` for names that do not exist and `SimulationError` where no start is found, naming the conditions
    that contradict each other, or the events that come to no end; with `throw=False` the start values are then NaN.
    """
    system = system_of(model)
    leaves, _ = complete_leaves(model)
    problem, constants = problem_of(system, leaves, conditions, steady=steady, moving=moving, free=free, strict=strict)
    params = system.enforced(system.parameters(leaves))
    easy = params if easier is None else system.enforced(system.parameters(complete_leaves(easier)[0]))
    starts = system.starts.pack(leaves)
    outcome, new = _solve(problem, params, easy, starts, jnp.asarray(t0, float), constants)
    if throw and not is_traced(outcome.found.violation) and not np.ndim(outcome.found.violation):
        _report(problem, outcome)
    return with_leaves(model, [new.get(i, leaf) for i, leaf in enumerate(leaves)])


@ft.partial(jax.jit, static_argnums=0)
def _solve(
    problem: Problem, params: list[Any], easy: list[Any], starts: Any, t0: Any, constants: list[Any]
) -> tuple[_Outcome, dict[int, Any]]:
    """What was found, and the new values of leaves by number."""
    system, constraints = problem.system, problem.system.constraints
    inputs = Inputs(system.pack_params(params), jnp.asarray(starts), problem.given)
    easy_inputs = Inputs(system.pack_params(easy), inputs.starts, problem.given)
    values, easier = Values(inputs, params, t0, constants), Values(easy_inputs, easy, t0, constants)
    fixed = _fixed(problem)
    search = Search(problem.residual, constraints.sizes, constraints.weights(fixed, 0.0))
    x0, discrete, happen, refused = start_point(system, inputs), None, jnp.zeros(0, bool), jnp.zeros(0, bool)

    def root(discrete: Any) -> Any:
        return search.best(x0, values.in_modes(system, discrete), easier.in_modes(system, discrete))

    if system.events is None:
        best = root(None)
    else:
        start = start_of(system, t0, x0[constraints.states], inputs, params)
        best, discrete, happen, refused = modes_at(start, t0, x0, root, lambda x: x[constraints.states])
    values = values.in_modes(system, discrete)
    found = search.found(best, x0, values)
    is_open = constraints.is_state & (found.freedom > OPEN)
    is_bad = jnp.any(happen) | jnp.any(refused) | (problem.strict & jnp.any(is_open))
    y = jnp.where(is_bad, jnp.nan, found.x[constraints.states])
    new = dict(zip(problem.wanted, observe(system, t0, y, values.inputs, problem.wanted), strict=True))
    return _Outcome(found, happen, refused, is_open), new | system.discrete_values(y, values.inputs)


def _fixed(problem: Problem) -> np.ndarray:
    return given_pairs(problem.system, Inputs({}, jnp.zeros(0), problem.fixed))


def _report(problem: Problem, outcome: _Outcome) -> None:
    found, events = outcome.found, problem.system.events
    if np.any(outcome.happen):
        assert events is not None
        names = [events.labels[i] for i in np.flatnonzero(outcome.happen)]
        raise SimulationError(
            f"The start values that satisfy the conditions are in no mode that they imply: {listed(names)} would "
            "happen, and lead elsewhere. Remedy: other first guesses or start values of the discrete variables, or "
            "conditions that fit one mode."
        )
    if not found.violation <= CLOSE:
        raise SimulationError(_contradiction(problem, found))
    if np.any(outcome.refused):
        assert events is not None
        raise SimulationError(f"There is no start. {refusal(events, outcome.refused)}")
    if problem.strict and np.any(outcome.is_open):
        names = sorted({constrained_names(problem.system)[i] for i in np.flatnonzero(outcome.is_open)})
        count = round(float(np.sum(found.freedom)))
        raise SimulationError(
            f"The conditions leave {count} of the start values undetermined, among these variables: "
            f"{listed(names)}. Remedy: give their start values, add conditions, or leave out strict=True "
            "to keep them where they are."
        )


def _contradiction(problem: Problem, found: Found) -> str:
    """Which conditions are not met, and with which others they clash."""
    names = problem.residual_names
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


def _given_names(problem: Problem) -> list[str]:
    return [problem.system.flat.leaves[i].path for i in sorted(problem.fixed)]


def _large(vector: np.ndarray) -> np.ndarray:
    return np.flatnonzero(np.abs(vector) > 0.05 * np.max(np.abs(vector), initial=0.0))
