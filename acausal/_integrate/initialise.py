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
from .._progress import compiling
from .._tracing import is_traced
from .field import Given
from .modes import modes_at
from .problem import Conditions, Problem, Values, problem_of
from .search import RANK, NearestPoint, Search
from .simulate import system_of
from .starting import refusal, start_of

OPEN = 1e-6  # freedom of a state from which on it counts as undetermined
M = TypeVar("M", bound=Component)


class _Outcome(NamedTuple):
    """What was found; the events that go on to happen there and those that are refused; what is undetermined; and the
    requirements that parameters found do not meet.
    """

    found: NearestPoint
    happen: Any
    refused: Any
    is_open: Any
    unmet: Any
    params: dict[int, Any]  # those found, by number


def initialise(
    model: M,
    conditions: Conditions | None = None,
    *,
    steady: bool = False,
    free: Sequence[str] | Literal["all"] | None = None,
    moving: Sequence[str] = (),
    easier: M | None = None,
    t0: Any = 0.0,
    solve_for: Sequence[str] = (),
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
    - `solve_for`: names of parameters that are searched for, too, as in `solve_for=["supply.V"]` with a condition on a
      speed. They start from the values in the model and move before states do, and the model returned has the values
      found. Past events happen with the values in the model.
    - `strict`: raise where the conditions leave a state or such a parameter undetermined. Otherwise what they leave
      open stays near its start value.

    Switches, diodes, friction and whatever else changes by events is in the mode that the start values imply, past
    events have happened, and the model returned holds the discrete variables that were found.

    The nearest solution to the start values is found by Levenberg and Marquardt's method, in nominal sizes. It is
    differentiable to any order in both modes, as an implicit function, and works under `jit` and `vmap`.

    Raises `ModelError` for names that do not exist and `SimulationError` where no start is found, naming the conditions
    that contradict each other, the events that come to no end, or a parameter found that is outside its range; with
    `throw=False` the start values and these parameters are then NaN.
    """
    system = system_of(model)
    leaves, _ = complete_leaves(model)
    problem, constants = problem_of(
        system, model, leaves, conditions, steady=steady, moving=moving, free=free, strict=strict, solve_for=solve_for
    )
    params = system.enforced(system.parameters(leaves))
    easy = params if easier is None else system.enforced(system.parameters(complete_leaves(easier)[0]))
    starts = system.starts.pack(leaves)
    with compiling("the start", model, _solve):
        outcome, new = _solve(problem, params, easy, starts, jnp.asarray(t0, float), constants)
    if throw and not is_traced(outcome.found.violation) and not np.ndim(outcome.found.violation):
        _report(problem, outcome, leaves)
    return with_leaves(model, [new.get(i, leaf) for i, leaf in enumerate(leaves)])


@ft.partial(jax.jit, static_argnums=0)
def _solve(
    problem: Problem, params: list[Any], easy: list[Any], starts: Any, t0: Any, constants: list[Any]
) -> tuple[_Outcome, dict[int, Any]]:
    """What was found, and the new values of leaves by number."""
    system, constraints = problem.system, problem.system.constraints
    inputs = Inputs(system.pack_params(params), jnp.asarray(starts), problem.given)
    easy_inputs = Inputs(system.pack_params(easy), inputs.starts, problem.given)
    trim, sizes = problem.trim, problem.trim.sizes(params)
    values, easier = Values(inputs, params, t0, constants, sizes), Values(easy_inputs, easy, t0, constants, sizes)
    ones = np.ones(trim.count)
    weights = constraints.weights(_fixed(problem), 0.0)
    search = Search(problem.residual, np.append(constraints.sizes, ones), np.append(weights, ones))
    x0, discrete, happen, refused = (
        jnp.append(start_point(system, inputs), trim.unknowns(params, sizes)),
        None,
        jnp.zeros(0, bool),
        jnp.zeros(0, bool),
    )

    def root(discrete: Any) -> Any:
        return search.best(x0, values.in_modes(system, discrete), easier.in_modes(system, discrete))

    def at(x: Any, given: Given) -> tuple[Any, Given]:
        return x[constraints.states], trim.given(x, jax.lax.stop_gradient(sizes), given)

    if system.events is None:
        best = root(None)
    else:
        start = start_of(system, t0, x0[constraints.states], inputs, params)
        best, discrete, happen, refused = modes_at(start, t0, x0, root, at)
    values = values.in_modes(system, discrete)
    found = search.found(best, x0, values)
    values = values.at(trim, found.x)
    is_open = np.append(constraints.is_state, ones > 0) & (found.freedom > OPEN)
    unmet = system.requirements.broken(values.inputs.params) if trim.leaves else jnp.zeros(0, bool)
    is_bad = jnp.any(happen) | jnp.any(refused) | jnp.any(unmet) | (problem.strict & jnp.any(is_open))
    y = jnp.where(is_bad, jnp.nan, found.x[constraints.states])
    new = dict(zip(problem.wanted, observe(system, t0, y, values.inputs, problem.wanted), strict=True))
    trimmed = trim.values(found.x, sizes)
    new |= {leaf: jnp.where(is_bad, jnp.nan, value) for leaf, value in trimmed.items()}
    outcome = _Outcome(found, happen, refused, is_open, unmet, trimmed)
    return outcome, new | system.discrete_values(y, values.inputs)


def _fixed(problem: Problem) -> np.ndarray:
    return given_pairs(problem.system, Inputs({}, jnp.zeros(0), problem.fixed))


def _report(problem: Problem, outcome: _Outcome, leaves: list[Any]) -> None:
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
    if np.any(outcome.unmet):
        system = problem.system
        values = system.parameters([outcome.params.get(i, leaf) for i, leaf in enumerate(leaves)])
        told = system.requirements.told(int(np.argmax(outcome.unmet)), system.pack_params(values))
        raise SimulationError(
            f"The conditions lead to a parameter that is not admissible: {told} Remedy: other conditions, a first "
            "guess nearer to an admissible value, or other parameters in solve_for."
        )
    if problem.strict and np.any(outcome.is_open):
        every = [*constrained_names(problem.system), *problem.trim.names]
        names = sorted({every[i] for i in np.flatnonzero(outcome.is_open)})
        count = round(float(np.sum(found.freedom)))
        what = "the start values and parameters" if problem.trim.leaves else "the start values"
        raise SimulationError(
            f"The conditions leave {count} of {what} undetermined, among these variables: "
            f"{listed(names)}. Remedy: give their start values, add conditions, or leave out strict=True "
            "to keep them where they are."
        )


def _contradiction(problem: Problem, found: NearestPoint) -> str:
    """Which conditions are not met, and with which others they clash."""
    names = problem.residual_names
    residual, slopes = np.asarray(found.residual), np.asarray(found.slopes)
    if not np.all(np.isfinite(residual)) or not np.all(np.isfinite(slopes)):
        bad = [name for name, value in zip(names, residual, strict=True) if not np.isfinite(value)]
        return (
            f"No start values were found: {listed(bad or names)} became infinite or not a number. Remedy: better "
            "first guesses, as start values with free=[...], or an `easier` model to start from."
        )
    # What is missed by the same amount but for rounding stays in the order in which it is stated.
    order = np.argsort(-np.round(np.abs(residual), 6), kind="stable")
    missed = [names[i] for i in order if abs(residual[i]) > CLOSE]
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
