"""Errors for a failed run: the time, the cause and the remedy."""

import contextlib
import contextvars
import dataclasses
import math
from collections.abc import Iterator

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._equinox_private import members_of
from ..._errors import ModelError, ParameterError, SimulationError
from ..._evaluate.diagnosis import block_of, first_not_finite, linear_blocks, without_storage
from ..._evaluate.initial import checked_names
from ..._evaluate.system import System
from ..._reduce.incidence import Pair, requirements
from ..._reduce.tear import Torn
from ..._tracing import known
from ..setup.field import values_of
from ..setup.result import Result, is_success, sentence
from ..setup.schedule import tick
from .checked import checked
from .solution import Solution

LAST = 8  # number of last event instants that are named
SHOWN = 3  # number of variables with large errors that are named
SMALL = 1e-3  # an error below this fraction of the tolerance is not informative, as in a short step after an event
_raises: contextvars.ContextVar[bool | None] = contextvars.ContextVar("raises", default=None)


@contextlib.contextmanager
def _failures(raises: bool) -> Iterator[None]:
    token = _raises.set(raises)
    try:
        yield
    finally:
        _raises.reset(token)


def trials() -> contextlib.AbstractContextManager[None]:
    """All real numbers of failed runs are NaN, whatever their `throw`, for a search that rejects them."""
    return _failures(False)


def diagnosis() -> contextlib.AbstractContextManager[None]:
    """Failed runs raise, whatever their `throw`, to name the cause."""
    return _failures(True)


def is_trial() -> bool:
    """Whether the run is inside `trials`, so that a failure does not raise."""
    return _raises.get() is False


def report_failure(solution: Solution, throw: bool) -> Solution:
    """Raise if the run failed and `throw`; under `jit`, at execution time. Otherwise return the solution.

    Inside `trials`, all real numbers of a failed run are NaN instead; inside `diagnosis`, it raises.
    """
    result = solution.result
    fine = is_success(result)
    if not throw and _raises.get() is None:
        return solution
    if is_trial():
        return jax.tree.map(lambda x: jnp.where(fine, x, jnp.nan) if eqx.is_inexact_array(x) else x, solution)
    are_fine = known(fine)
    if are_fine is None:
        return _checked_at_run_time(solution, ~jnp.asarray(fine))
    if not np.all(are_fine):
        raise _error(jax.tree_util.tree_map(jax.lax.stop_gradient, solution))
    return solution


def _checked_at_run_time(solution: Solution, failed: Array) -> Solution:
    """The solution with a check, so that a failed run raises when it or its derivatives are computed. The error names
    an invalid parameter or option; only runs outside of `jit` name other causes.
    """
    result, culprit = solution.result, solution._culprit
    outcomes, demands = list(members_of(Result).values()), list(solution._demands)
    needed = [f"{sentence}." for sentence in solution.system.intake.needed(solution._inputs.given)]
    index = sum(jnp.where(result == outcome, number, 0) for number, outcome in enumerate(outcomes))
    index = jnp.where(result == Result.bad_option, len(outcomes) + culprit, index)
    index = jnp.where(result == Result.bad_parameter, len(outcomes) + len(demands) + culprit, index)
    return checked(solution, failed, index, [*map(sentence, outcomes), *demands, *needed])


def _error(solution: Solution) -> Exception:
    system, result = solution.system, solution.result
    if solution.is_batched:
        return SimulationError("Some runs of the batch failed: pass throw=False and read sol.result.")
    if result == Result.bad_option:
        return ModelError(solution._demands[int(solution._culprit)])
    if result == Result.bad_parameter:
        return ParameterError(system.intake.bad_value(int(solution._culprit), solution._inputs))
    if result == Result.bad_start:
        name = checked_names(system, solution._inputs.given)[int(solution._culprit)]
        return SimulationError(
            f"{sentence(result)} {name} cannot have the value it is given: omit the start value of this variable, or "
            "of those rigidly connected to it."
        )
    t, _ = solution._end
    where = f"At t = {float(t):.6g} s: "
    if any(result == outcome for outcome in (Result.events_accumulate, Result.events_endless, Result.bad_reset)):
        return SimulationError(f"{where}{sentence(result)} The last events were {_last_events(solution)}.")
    if result == Result.refused:
        return SimulationError(f"{where}{_refusal(solution) or sentence(result)}")
    if result == Result.history_full:
        assert system.events is not None
        return SimulationError(f"{where}{system.events.history_names[int(solution._culprit)]}: {sentence(result)}")
    if result == Result.undetermined:
        return SimulationError(
            where + sentence(result) + about_block(system, linear_blocks(system)[int(solution._culprit)])
        )
    if result == Result.never_stopped:
        return SimulationError(where + sentence(result))
    found = _first_not_finite(solution)
    if found is not None:
        t, culprit = found
        where = f"At t = {t:.6g} s: "
        name = system.ordered.table.variable_name(*culprit)
        since = t - float(tick(t, solution._start[0]))
        if refused := _refusal(solution, since):
            return SimulationError(f"{where}{refused}")
        after = _events_at(solution, since) if t == float(solution._end[0]) else ""
        said = f"After {after}, {name} is infinite or not a number." if after else ""
        said = said or f"{sentence(Result.not_finite)} The first one is {name}."
        said += about_range(system, culprit)
        return SimulationError(f"{where}{said}{about_block(system, culprit)}")
    if solution._layout.n_integrals and not np.all(np.isfinite(solution._errors)):
        return SimulationError(
            f"{where}The next step is infinite or not a number, although all variables are finite here. Remedy: look "
            "in the functions of `integrals` for logarithms, roots and quotients without a value."
        )
    said = _about_delay(solution) if result == Result.too_many_steps else ""
    return SimulationError(where + (said or f"{sentence(result)}{_about_steps(solution)}"))


def _about_steps(solution: Solution) -> str:
    """The variables with the largest errors, and the last events."""
    system, errors = solution.system, np.asarray(solution._errors)
    names = system.element_names
    values = np.asarray(solution._end[1])
    lines = []
    if np.all(np.isfinite(errors)):
        largest = np.argsort(-errors[: len(names)], kind="stable")[:SHOWN]
        said = [f"{names[i]} (now {values[i]:.6g}, {errors[i]:.3g} tolerances)" for i in largest if errors[i] > SMALL]
        if said:
            lines.append(f"The largest errors in the last step are those of {', '.join(said)}.")
    else:
        lines.append("The last step produced values that are infinite or not a number.")
    if solution.result == Result.step_too_small:
        lines.append(_about_fastest(solution))
    if last := _last(solution):
        span = float(solution._end[0]) - last[0][0]
        lines.append(f"The last events were {_last_events(solution)}, {len(last)} within {span:.3g} s.")
        mean = (float(solution._end[0]) - float(solution._start[0])) / int(solution.stats["num_steps"])
        if solution.result == Result.too_many_steps and abs(span) <= len(last) * abs(mean):
            lines.append(_SLIDES)
    return "".join(f" {line}" for line in lines)


_SLIDES = (
    "They end nearly every step: the solution slides along a switching surface. Remedy: use an element made for this, "
    "such as friction, a stop, a freewheel or a diode, or a hysteresis between the two conditions."
)


def _about_delay(solution: Solution) -> str:
    """The message for a delay of a recorded signal that alone requires more steps than permitted; otherwise empty."""
    system, (t, y) = solution.system, solution._end
    if system.events is None or not system.events.remembered:
        return ""
    delays = system.events.delays
    params = dataclasses.replace(solution._inputs.params, leaves=dict(solution._params))
    values = values_of(system, t, y, dataclasses.replace(solution._inputs, params=params), None, delays.leaves)
    found = np.concatenate([np.ravel(delay) for delay in delays([values[leaf] for leaf in delays.leaves])])
    t1 = solution._numbers["t1"]
    assert t1 is not None
    shortest, span = int(np.argmin(found)), abs(float(t1) - float(solution._start[0]))
    if span <= found[shortest] * int(solution.stats["max_steps"]):
        return ""
    return (
        f"The maximum number of steps was reached: no step is longer than the delay of {found[shortest]:.3g} s of "
        f"{system.events.history_names[shortest]}, so {span:.3g} s take at least {math.ceil(span / found[shortest])} "
        "steps. Increase max_steps, or leave the delay out if it does not matter."
    )


def _about_fastest(solution: Solution) -> str:
    """The state that changes fastest, and what its component says about its equations."""
    system, (t, y) = solution.system, solution._end
    rates = np.abs(system.vector_field(t, y, solution._inputs))
    sizes = np.maximum(np.abs(y[: len(rates)]), system.nominals[: len(rates)])
    fastest = int(np.nanargmax(rates / sizes))
    counts = [system.plan.size(variable) for variable, _ in system.states]
    variable, order = system.states[int(np.searchsorted(np.cumsum(counts), fastest, side="right"))]
    block = block_of(system, (variable, order + 1))
    said = f"{system.element_names[fastest]} changes fastest, at {rates[fastest]:.3g} per second"
    if block is None or not (meaning := _if_singular(system, block)):
        return f"{said}."
    equations = ", ".join(map(system.ordered.table.row_name, block.rows))
    return f"{said}, according to the equations {equations}: {meaning}."


def _if_singular(system: System, block: Torn) -> str:
    """The explanations that components give for singular equations in a block."""
    families = (family for family, _ in map(system.ordered.table.place, block.rows))
    owners = [family.instances for family in families if family.instances is not None]
    return "; ".join(filter(None, dict.fromkeys(owner.kind.cls.if_singular for owner in owners)))


def _last(solution: Solution) -> list[tuple[float, int]]:
    """The times and numbers of the last events, in chronological order."""
    history = solution._history
    if history is None:
        return []
    times, happened = np.asarray(history.times), np.asarray(history.happened)
    last = np.flatnonzero(np.isfinite(times))[-LAST:]
    return [(float(times[moment]), number) for moment in last for number in np.flatnonzero(happened[moment]).tolist()]


def _last_events(solution: Solution) -> str:
    """The distinct last events of a run: the listed ones, or all of them if none is listed."""
    events = solution.system.events
    numbers = [number for _, number in _last(solution)]
    if events is None or not numbers:
        return "those at the start"
    listed = [number for number in numbers if not events.members[number].is_internal] or numbers
    return ", ".join(dict.fromkeys(events.labels[number] for number in listed))


def _refusal(solution: Solution, since: float = -math.inf) -> str:
    """The messages of refused events from the time `since` on; empty if there are none."""
    events = solution.system.events
    if events is None:
        return ""
    numbers = [number for time, number in _last(solution) if time >= since]
    return " ".join(dict.fromkeys(events.refusal(number) for number in numbers if events.members[number].reason))


def _events_at(solution: Solution, since: float) -> str:
    """The events from the time `since` on, as text; empty if there are none."""
    if solution.system.events is None:
        return ""
    labels = solution.system.events.labels
    names = [labels[number] for time, number in _last(solution) if time >= since]
    return f"the event {names[0]}" if len(names) == 1 else f"the events {', '.join(names)}" if names else ""


def about_range(system: System, pair: Pair) -> str:
    """The declared ranges of a variable and of the variables in its block; empty if there are none."""
    block = block_of(system, pair)
    pairs = [system.ordered.unknowns[u] for u in block.unknowns] if block else [pair]
    return "".join(f" {said}: outside it has no value." for said in requirements(system.ordered.table, pairs))


def about_block(system: System, pair: Pair) -> str:
    """The block of equations that determines a variable, why it fails, and the remedy; empty if there is none."""
    block = block_of(system, pair)
    if block is None:
        return ""
    table = system.ordered.table
    equations = ", ".join(table.row_name(row) for row in block.rows)
    unknowns = ", ".join(system.ordered.unknown_name(unknown) for unknown in block.unknowns)
    guesses = ", ".join(system.ordered.unknown_name(unknown) for unknown in block.tears)
    if block.method == "linear":
        reason = "are singular there: they do not determine their unknowns"
        remedy = _if_singular(system, block)
        remedy = remedy or "look for parameters that are zero, or for ideal elements that fix one value twice"
    else:
        reason = "have no solution there, or the iteration does not converge to it"
        remedy = f"give start values near the solution for {guesses}, or check the range of validity of these equations"
    said = f" The equations {equations} for {unknowns} {reason}. Remedy: {remedy}."
    for ports, storage in without_storage(system, block):
        said += f" No component stores the flow into {ports}: if the flow has no other path, connect {storage} there."
    return said


def _first_not_finite(solution: Solution) -> tuple[float, Pair] | None:
    """The time and the variable of the first value that is not finite: at the start, at a saved point if no state
    depends on it, or at the last finite state or shortly after it.
    """
    system, (t, y) = solution.system, solution._end
    for point in (solution._start, *([solution._not_finite] if solution.result == Result.not_finite else [])):
        if (pair := first_not_finite(system, *point, solution._inputs)) is not None:
            return float(point[0]), pair
    rates = system.vector_field(t, y, solution._inputs)
    for ahead in (0.0, 1e-12, 1e-9, 1e-6, 1e-4):
        point = y.at[: len(rates)].add(ahead * jnp.where(jnp.isfinite(rates), rates, 0.0))
        pair = first_not_finite(system, t + ahead, point, solution._inputs)
        if pair is not None:
            return float(t), pair
    return None
