"""What to raise where no start values are found."""

from typing import Any

import numpy as np

from .._errors import SimulationError, listed
from .._evaluate.constraints import CLOSE
from .._evaluate.initial import constrained_names
from .problem import Problem
from .search import RANK, NearestPoint
from .start_search import Outcome
from .starting import refusal


def report_no_start(problem: Problem, outcome: Outcome, leaves: list[Any]) -> None:
    """Raise `SimulationError` for a search that did not find what it was asked for."""
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
    given = _given_names(problem)
    less = "remove one of the conditions" + (f", or leave out or free a start value: {listed(given)}" if given else "")
    other = "better first guesses, as start values with free=[...], or an `easier` model to start from"
    lines.append(f"  Remedy: {less if clashes else other}.")
    return "\n".join(lines)


def _given_names(problem: Problem) -> list[str]:
    return [problem.system.flat.leaves[i].path for i in sorted(problem.fixed)]


def _large(vector: np.ndarray) -> np.ndarray:
    return np.flatnonzero(np.abs(vector) > 1e-6 * np.max(np.abs(vector), initial=0.0))
