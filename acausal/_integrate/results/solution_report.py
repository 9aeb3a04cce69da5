"""Parts of the report of a solution: outcome, pictures, events, energy, variables and parameters."""

from collections.abc import Iterator, Sequence
from typing import Any

import jax
import numpy as np

from ..._declare.by_name import parameters
from ..._declare.tree import with_unit
from ..._errors import ModelError
from ..._report import Table, drawn, provenance
from ..programs.program_digest import equations_of
from ..setup.result import sentence
from .columns import Item, columns
from .energy import EnergyAccount
from .event_log import EventLog
from .solution import Solution

ROWS = 500  # maximum number of events in a report
TIMES = ("t0", "t1", "dt0", "dtmin", "dtmax")  # options in seconds


def parts(solution: Solution[Any], items: Sequence[Item], units: Sequence[str]) -> dict[str, object]:
    """The contents of the report by heading. Raises `ModelError` for a batch or a traced solution."""
    if solution._cannot_be_shown:
        raise ModelError(
            "A report shows a single run with known numbers: call html outside of jit, and select one run of a batch "
            "with jax.tree_util.tree_map(lambda x: x[i], sol)."
        )
    return dict(_parts(solution, items, units))


def _parts(solution: Solution[Any], items: Sequence[Item], units: Sequence[str]) -> Iterator[tuple[str, object]]:
    yield "Outcome", _outcome(solution)
    if len(solution.ts) > 1 and (items or solution.system.state_names):
        yield "Trajectories", drawn(lambda: solution.plot(*items, units=units))
    if len(solution.events):
        yield "Events", event_table(solution.events)
    account = _account(solution)
    if account is not None:
        yield "Energy", _energy(account)
    yield "Parameters", _parameters(solution)
    yield "Options of the run", _options(solution)
    equations = equations_of(solution.system)
    yield "Model", provenance(solution.system.name, parameters(solution.final), equations)
    yield "Variables", _variables(solution)


def _outcome(solution: Solution[Any]) -> Table:
    accepted, rejected = (int(solution.stats[f"num_{name}_steps"]) for name in ("accepted", "rejected"))
    rows = [
        ("result", sentence(solution.result)),
        ("end of the run", f"{float(solution.t1):.9g} s"),
        ("steps", f"{accepted} accepted, {rejected} rejected"),
    ]
    rows += [
        (f"not resolved: {name}", f"at most {with_unit(value, _unit(solution, name))}")
        for name, value in solution.unresolved.items()
    ]
    return Table(("", ""), rows)


def _unit(solution: Solution[Any], name: str) -> str:
    return solution.unit(name) if name in solution else ""


def event_table(log: EventLog) -> Table:
    """The events of a single run."""
    times = np.asarray(log.times)[:ROWS].tolist()
    rows = [(f"{t:.9g}", name) for t, name in zip(times, log.names[:ROWS], strict=False)]
    rows += [("...", f"and {len(log) - ROWS} more")] if len(log) > ROWS else []
    ticks = [(f"{tick.first:.9g} to {tick.last:.9g}", f"{tick.label}, {tick.count} times") for tick in log.ticks]
    return Table(("time [s]", "event"), [*rows, *ticks])


def _account(solution: Solution[Any]) -> EnergyAccount | None:
    """The energy account; None if the run has neither integrated it nor recorded its steps, or if it is empty."""
    try:
        account = solution.energy
    except ModelError:
        return None
    return account if account.supplied or account.events else None


def _energy(account: EnergyAccount) -> list[object]:
    sums = [*account.totals, sum(account.events.values())]
    events = [(name, "", "", _number(lost)) for name, lost in account.events.items() if lost != 0]
    rows = [
        (name, *map(_number, (account.supplied[name], account.stored[name], account.dissipated[name])))
        for name in account.supplied
    ]
    total = ("total", _number(sums[0]), _number(sums[1]), _number(sums[2] + sums[3]))
    heads = ("component or event", "supplied [J]", "stored [J]", "dissipated [J]")
    table = Table(heads, [*rows, *events, total, ("imbalance", _number(account.imbalance), "", "")])
    return [drawn(account.plot), table] if any(np.any(np.asarray(x) != 0.0) for x in sums) else [table]


def _number(value: object) -> str:
    return f"{float(np.asarray(value)) + 0.0:.6g}"


def _variables(solution: Solution[Any]) -> Table:
    """Values at the first and the last saved time, and the smallest and the largest of all, for each variable."""
    rows = []
    for label, unit, values, *_ in columns(solution, (), ()):
        ends = (values[0], values[-1], np.min(values, axis=0), np.max(values, axis=0))
        rows.append((label, *(with_unit(value, "") for value in ends), unit or "-"))
    times = np.asarray(solution.ts)
    heads = ("variable", f"at {times[0]:.6g} s", f"at {times[-1]:.6g} s", "smallest", "largest", "unit")
    return Table(heads, rows, "At the saved times")


def _parameters(solution: Solution[Any]) -> Table:
    """Parameters with the requirements on each, which a run checks at its start."""
    found, sentences = parameters(solution.final), solution.system.intake.requirements.sentences
    rows = []
    for path, value in found.items():
        needed = [text.removeprefix(f"{path} ") for text in sentences if text.startswith(f"{path} ")]
        rows.append((path, with_unit(value, ""), found.units[path] or "-", "; ".join(needed)))
    return Table(("parameter", "value", "unit", "requirement"), rows)


def _options(solution: Solution[Any]) -> Table:
    given = {name: value for name, value in solution.options.items() if value is not None}
    numbers = {name: value for name, value in given.items() if isinstance(value, jax.Array | np.ndarray | int | float)}
    rows = [
        (name, with_unit(value, "s" if name in TIMES else "") if name in numbers else str(value))
        for name, value in given.items()
    ]
    return Table(("option", "value"), rows)
