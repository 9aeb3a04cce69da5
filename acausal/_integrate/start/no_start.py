"""Errors for a failed search for start values."""

import itertools
from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._errors import SimulationError, listed
from ..._evaluate.constraints import CLOSE
from ..._evaluate.initial import constrained_names
from ..._numbers import Numbers
from ..._reduce.incidence import ranges_of, requirements
from .problem import Problem
from .search import RANK, NearestPoint
from .start_search import Outcome

EDGE = 1e-3  # distance from the edge of a range that counts as zero, relative to the nominal size


def report_no_start(
    problem: Problem, outcome: Outcome, leaves: Sequence[Numbers | None], new: dict[int, Array], t0: Numbers
) -> None:
    """Raise `SimulationError` if the search for start values failed. `leaves` are those of the model, and `new` ones
    those at the end of the search.
    """
    found, events = outcome.found, problem.system.events
    if np.any(outcome.happen):
        assert events is not None
        names = [events.labels[i] for i in np.flatnonzero(outcome.happen)]
        raise SimulationError(
            f"No modes are consistent with the start values that they imply: {listed(names)} would fire one after the "
            "other without end. A system that keeps switching has no equilibrium but a limit cycle, which a simulation "
            "reaches. Remedy, if there is an equilibrium: guess the variables of these parts near it and in its mode, "
            "by replace(model, {...}), such as the s_rel of a stretched rope. Otherwise: other start values of the "
            "discrete variables, or conditions for one mode."
        )
    if not found.violation <= CLOSE:
        is_kept = problem.system.flat.is_variable
        leaves = [leaf if is_kept(i) else outcome.params.get(i, new.get(i, leaf)) for i, leaf in enumerate(leaves)]
        said = [_contradiction(problem, outcome), _about_flat(problem, found)]
        raise SimulationError("".join([*said, _about_ranges(problem, found, leaves, t0), _about_modes(problem)]))
    if np.any(outcome.refused):
        assert events is not None
        raise SimulationError(f"The start values found are invalid. {events.refusal(int(np.argmax(outcome.refused)))}")
    if np.any(outcome.violated):
        system = problem.system
        values = system.intake.parameters([outcome.params.get(i, leaf) for i, leaf in enumerate(leaves)])
        violation = system.intake.requirements.violation(int(np.argmax(outcome.violated)), system.intake.packed(values))
        raise SimulationError(
            f"The conditions lead to an inadmissible parameter value: {violation} Remedy: other conditions, an initial "
            "guess closer to an admissible value, or other parameters in solve_for."
        )
    if problem.strict and np.any(outcome.is_open):
        names = _undetermined(problem, outcome)
        count = round(float(np.sum(found.freedom)))
        what = "the start values and parameters" if problem.trim.leaves else "the start values"
        raise SimulationError(
            f"The conditions leave {count} of {what} undetermined, among these variables: "
            f"{listed(names)}. Remedy: give their start values, add conditions, or omit strict=True "
            "to keep them near their start values."
        )


def _contradiction(problem: Problem, outcome: Outcome) -> str:
    """The conditions that are not met, those in conflict, and the remedy."""
    names, found = problem.residual_names, outcome.found
    residual, slopes = np.asarray(found.residual), np.asarray(found.slopes)
    if not np.all(np.isfinite(residual)) or not np.all(np.isfinite(slopes)):
        bad = [name for name, value in zip(names, residual, strict=True) if not np.isfinite(value)]
        return (
            f"No start values were found: {listed(bad or names)} became infinite or not a number. Remedy: give "
            "better initial guesses as start values with free=[...], or an `easier` model to start from."
        )
    # Residuals that are equal to within rounding keep their order.
    order = np.argsort(-np.round(np.abs(residual), 6), kind="stable")
    missed = [names[i] for i in order if abs(residual[i]) > CLOSE]
    lines = [f"No start values satisfy the conditions. Not met: {listed(missed)}."]
    left, sizes, _ = np.linalg.svd(slopes)
    rank = int(np.sum(sizes > RANK * max(sizes, default=0.0)))
    clashes = [_large(vector) for vector in _reduced(left.T[rank:]) if abs(vector @ residual) > CLOSE]
    rests = problem.rest_names
    unbalanced = [[rests[i] for i in clash] for clash in clashes if rests.keys() >= set(clash.tolist())]
    if clashes and len(unbalanced) == len(clashes):
        states = list(dict.fromkeys(itertools.chain(*unbalanced)))
        return "\n".join([*lines, *map(_unbalanced, unbalanced), _BALANCE.format(states)])
    for clash in clashes:
        lines.append(f"  Conditions in conflict, linearly dependent: {listed([names[i] for i in clash])}.")
    given = _given_names(problem)
    less = "remove one of the conditions" + (f", or omit or free a start value: {listed(given)}" if given else "")
    still = _undetermined(problem, outcome) if any(len(clash) == 1 for clash in clashes) else []
    if still:
        less += f", or, if a condition depends on them, give other initial guesses of {listed(still)}"
    other = "give better initial guesses as start values with free=[...], or an `easier` model to start from"
    lines.append(f"  Remedy: {less if clashes else other}.")
    return "\n".join(lines)


_BALANCE = (
    "  Remedy: `moving={}` for states that may change in a steady state, such as the angle of a shaft or the charge of "
    "a battery; otherwise a part that balances them, such as a spring, a leak or a feedback, or `solve_for` a "
    "parameter that does."
)


def _unbalanced(states: list[str]) -> str:
    """The sentence for states with rates that no start value can bring to zero together."""
    if len(states) == 1:
        return f"  No steady state: {states[0]} integrates something that is not zero, and no start value balances it."
    return f"  No steady state: no start values bring the rates of {listed(states)} to zero together."


def _about_flat(problem: Problem, found: NearestPoint) -> str:
    """The unmet conditions with a zero gradient at the end of a search, such as the flow of a closed valve."""
    residual, slopes = np.abs(found.residual), np.max(np.abs(found.slopes), axis=1, initial=0.0)
    is_flat = (residual > 1.0 / RANK) | ((slopes <= RANK) & (residual > CLOSE) & bool(problem.trim.leaves))
    names = [name for name, flat in zip(problem.residual_names, is_flat, strict=True) if flat]
    if not names:
        return ""
    guesses = f", for example of {listed(problem.trim.names)}" if problem.trim.leaves else ""
    return (
        f"\n  At the end of the search, {listed(names)} hardly depends on any unknown, so the derivatives give no "
        f"direction. Remedy: give initial guesses at which it does{guesses}."
    )


def _about_modes(problem: Problem) -> str:
    events = problem.system.events
    if events is None or not any(entry.targets for entry in events.entries):
        return ""
    return (
        "\n  The search tried the modes that the start values imply, those that follow from these, and those after one "
        "further event at a time. Remedy, if other modes can meet the conditions: give start values that imply these "
        "modes, such as a position beyond a stop."
    )


def _about_ranges(problem: Problem, found: NearestPoint, leaves: Sequence[Numbers | None], t0: Numbers) -> str:
    """The ranges at whose edge the search ended, or which its next step would leave."""
    system, constraints = problem.system, problem.system.constraints
    table, count = system.ordered.table, len(constraints.sizes)
    pairs = [(variable, 0) for variable in ranges_of(table) if (variable, 0) in system.plan.places]
    if not pairs or not np.all(np.isfinite(found.x)) or not np.all(np.isfinite(found.slopes)):
        return ""
    inputs, end = system.intake.inputs_of(leaves), np.asarray(found.x)[:count]
    scale = constraints.sizes * np.sqrt(constraints.weights(problem.held, 0.0))
    step = -scale * (np.linalg.pinv(found.slopes, rtol=RANK) @ np.asarray(found.residual))[:count]
    here, next_ = (
        [system.collected(t0, jnp.asarray(x)[constraints.states], inputs, [pair]) for pair in pairs]
        for x in (end, end + step)
    )
    left = [
        pair
        for pair, x, y in zip(pairs, here, next_, strict=True)
        if not np.all(np.abs(x) > EDGE * system.sizes_of([pair])) or np.any(np.isnan(y))
    ]
    said = requirements(table, left)
    return f"\n  The search ended where its next step would leave a range: {'; '.join(said)}." if said else ""


def _undetermined(problem: Problem, outcome: Outcome) -> list[str]:
    """The states and unknown parameters that the conditions leave undetermined at the end of the search."""
    every = [*constrained_names(problem.system), *problem.trim.names]
    return sorted({every[i] for i in np.flatnonzero(outcome.is_open)})


def _given_names(problem: Problem) -> list[str]:
    return [problem.system.flat.leaves[i].path for i in sorted(problem.fixed)]


def _reduced(basis: np.ndarray) -> np.ndarray:
    """A basis of the same space in reduced row echelon form, so that unrelated dependencies are apart."""
    rows = np.array(basis)
    for i in range(len(rows)):
        k, column = np.unravel_index(np.argmax(np.abs(rows[i:])), rows[i:].shape)
        rows[[i, i + k]] = rows[[i + k, i]]
        rows[i] /= rows[i, column]
        others = np.arange(len(rows)) != i
        rows[others] -= np.outer(rows[others, column], rows[i])
    return rows


def _large(vector: np.ndarray) -> np.ndarray:
    return np.flatnonzero(np.abs(vector) > 1e-6 * np.max(np.abs(vector), initial=0.0))
