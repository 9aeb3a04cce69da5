"""`choose`: the best combination of what a catalogue offers."""

import dataclasses
import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from .._analyse.table import aligned
from .._declare.component import Component
from .._errors import ModelError, SimulationError
from .._extras import needed
from ._bar import bar
from ._batches import CHUNK, Outcomes, Task, said
from ._limits import Limit, Objective, limits_of, objectives_of
from ._pieces import evaluated
from ._sweep import MOST, listed

Table = Sequence[Mapping[Any, Any]]


@dataclasses.dataclass(frozen=True, eq=False)
class Choice:
    """All combinations with their results; `print` it for the best of them and what ruled the others out.

    - `combinations`: the names of the alternatives of each, by table.
    - `values`: of the objectives, in SI units; not a number for what could not be computed.
    - `excess`: by how much each limit is broken, as a fraction of it; negative inside of it.
    - `outcomes`: results and codes as they were computed.
    """

    combinations: tuple[Mapping[str, str], ...]
    objectives: tuple[Objective, ...]
    limits: tuple[Limit, ...]
    values: Float[np.ndarray, "n p"]
    excess: Float[np.ndarray, "n q"]
    outcomes: Outcomes

    @property
    def is_computed(self) -> Bool[np.ndarray, " n"]:
        return self.outcomes.are_good

    @property
    def is_feasible(self) -> Bool[np.ndarray, " n"]:
        """Combinations that keep all limits."""
        return self.is_computed & np.all(self.excess <= 1e-9, axis=1)

    @property
    def order(self) -> list[int]:
        """The feasible combinations, the best one by the first objective first."""
        feasible = np.flatnonzero(self.is_feasible)
        return feasible[np.argsort(self.values[feasible, 0], kind="stable")].tolist()

    @property
    def best(self) -> int | None:
        """The best feasible combination by the first objective; None where there is none."""
        return self.order[0] if self.order else None

    @property
    def front(self) -> list[int]:
        """Feasible combinations that no other one betters in one objective without being worse in another."""
        found: list[int] = []
        for i in self.order:
            kept, value = self.values[found], self.values[i]
            if not np.any(np.all(kept <= value, axis=1) & np.any(kept < value, axis=1)):
                found.append(i)
        return found

    def ruled_out(self, i: int) -> tuple[str, ...]:
        """What speaks against a combination: the limits that it breaks, or why it could not be computed."""
        if not self.is_computed[i]:
            return (said(int(self.outcomes.codes[i])).split(". ")[0].rstrip("."),)
        broken = zip(self.limits, self.excess[i], strict=True)
        return tuple(f"{limit.name} {limit.text}" for limit, excess in broken if excess > 1e-9)

    @property
    def reasons(self) -> dict[str, tuple[int, int]]:
        """By limit or failure: how many combinations it rules out, and how many it alone does."""
        counts: dict[str, list[int]] = {}
        for i in np.flatnonzero(~self.is_feasible).tolist():
            against = self.ruled_out(i)
            for reason in against:
                pair = counts.setdefault(reason, [0, 0])
                pair[0] += 1
                pair[1] += len(against) == 1
        return {reason: (pair[0], pair[1]) for reason, pair in sorted(counts.items(), key=lambda item: -item[1][0])}

    def plot(self, ax: Any = None, beside: Any = None) -> Any:
        """Feasible combinations by two objectives with the front, or in order by one; `beside`: objectives to compare.

        Returns the matplotlib axes.
        """
        if ax is None:
            plt = needed("matplotlib.pyplot", "plots", "A picture")
            _, ax = plt.subplots(figsize=(6.5, 4.2), layout="constrained")
        first, second = self.objectives[0], self.objectives[1] if len(self.objectives) > 1 else None
        shown = self.order if second is None else np.flatnonzero(self.is_feasible).tolist()
        x = first.scale.value(self.values[shown, 0])
        y = np.arange(1, len(shown) + 1) if second is None else second.scale.value(self.values[shown, 1])
        ax.plot(x, y, ".", color="0.6", label="feasible")
        if second is not None:
            front = self.values[self.front]
            places = first.scale.value(front[:, 0]), second.scale.value(front[:, 1])
            ax.plot(*places, "o-", color="tab:blue", label="front")
        if beside is not None:
            place = np.ravel(np.asarray(beside, float))
            ax.axvline(first.scale.value(place[0]), color="tab:orange", label="continuous optimum")
        ax.set_xlabel(first.scale.headed(first.name))
        ax.set_ylabel("rank" if second is None else second.scale.headed(second.name))
        ax.legend(frameon=False, fontsize="small")
        ax.grid(alpha=0.3)
        return ax

    def __repr__(self) -> str:
        return f"<Choice among {len(self.combinations)} combinations, {int(np.sum(self.is_feasible))} feasible>"

    def __str__(self) -> str:
        head = ["", *self.combinations[0], *(objective.scale.headed(objective.name) for objective in self.objectives)]
        ranked = enumerate(self.order[:10], start=1)
        rows = [[str(rank), *self.combinations[i].values(), *self._shown(i)] for rank, i in ranked]
        lines = [f"{len(self.combinations)} combinations, {int(np.sum(self.is_feasible))} feasible"]
        lines += [aligned([head, *rows])] if rows else []
        for reason, (number, alone) in self.reasons.items():
            lines.append(f"ruled out by {reason}: {number}, {alone} of them by it alone")
        return "\n".join(lines)

    def _shown(self, i: int) -> list[str]:
        return [f"{o.scale.value(value):.5g}" for o, value in zip(self.objectives, self.values[i], strict=True)]


def choose(
    model: Component,
    tables: Mapping[str, Table],
    minimise: Any,
    *,
    run: Callable[[Any], Any] | None = None,
    constraints: Mapping[str, Any] | None = None,
    executor: Any = None,
    progress: bool | None = None,
) -> Choice:
    """Run all combinations of what tables offer, and say which are feasible, which is best and what rules others out.

        choose(
            drive,
            {"motor": [{"name": "A", "motor.emf.k": 0.02, "motor.resistor.R": "0.3 ohm"}, {"name": "B", ...}],
             "gear": [{"gear.ratio": 5.0}, {"gear.ratio": 8.0}]},
            {"time": (lambda s: s.t1, "ms")},
            run=lambda m: simulate(m, 0.5, until=lambda s: s.load.b.phi - 0.8, save="end"),
            constraints={"final speed": (lambda s: s.final.load.w, "<= 100 rpm")},
        )

    - `tables`: alternatives by what they are for, each a dictionary of values by path (or a `pandas.DataFrame`), with
      its "name" if it has one. Values are in declared units, quantities or texts with a unit. The rows of a table name
      the same paths; what has another structure, such as two stages instead of one, is a choice of its own.
    - `minimise`, `run`, `constraints`: as in `optimise`; with several objectives, the first one ranks and all of them
      make the front.
    - `executor`, `progress`: as in `sweep`.

    Raises `ModelError` or `ParameterError` for what is wrong with tables, and `SimulationError` where no combination
    can be computed.
    """
    rows, names = _combined(tables)
    members = listed(model, rows)
    objectives, limits = objectives_of(minimise), limits_of(constraints)
    functions = {o.name: o.function for o in objectives} | {name: pair[0] for name, pair in limits.items()}
    if len(functions) < len(objectives) + len(limits):
        raise ModelError("An objective and a constraint have one name. Rename one.")
    task = Task(model, members.free, functions, run)
    outcomes = evaluated(task, members.x, executor=executor, chunk=CHUNK, progress=bar("combinations", progress))
    if not np.any(outcomes.are_good):
        raise SimulationError(f"None of {len(rows)} combinations could be computed: {said(int(outcomes.codes[0]))}")
    _, owners = task.columns()
    several = [o.name for o in objectives if owners.count(o.name) != 1]
    if several:
        raise ModelError(f"{several[0]} returned {owners.count(several[0])} numbers: what is minimised is one.")
    columns = [owners.index(o.name) for o in objectives]
    stated = [limits[owner][1] for owner in owners if owner in limits]
    places = [i for i, owner in enumerate(owners) if owner in limits]
    excess = [_excess(limit, outcomes.values[:, i]) for limit, i in zip(stated, places, strict=True)]
    values = np.where(outcomes.are_good[:, None], outcomes.values[:, columns], np.nan)
    table = np.stack(excess, axis=1) if excess else np.zeros((len(rows), 0))
    return Choice(names, objectives, tuple(stated), values, table, outcomes)


def _excess(limit: Limit, values: np.ndarray) -> np.ndarray:
    excess = np.asarray(limit.excess(values))
    return np.abs(excess) if limit.is_equation else excess


def _label(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _combined(tables: Mapping[str, Any]) -> tuple[list[dict[Any, Any]], tuple[dict[str, str], ...]]:
    """The values of each combination, and the names of its alternatives."""
    if not isinstance(tables, Mapping) or not tables:
        raise ModelError(f"tables is a dictionary of at least one table, got {tables!r}.")
    plain: dict[str, list[dict[Any, Any]]] = {}
    for title, table in tables.items():
        rows = table.to_dict("records") if hasattr(table, "to_dict") else list(table)
        if not rows or not all(isinstance(row, Mapping) for row in rows):
            raise ModelError(f"{title}: a table is a list of dictionaries with values by path, got {table!r}.")
        plain[title] = [dict(row) for row in rows]
    n = math.prod(len(rows) for rows in plain.values())
    if n > MOST:
        raise ModelError(f"{n} combinations are too many. Leave out alternatives that cannot win.")
    labels = {
        title: [str(row.pop("name", "") or ", ".join(map(_label, row.values()))) for row in rows]
        for title, rows in plain.items()
    }
    values, names = [], []
    for picked in itertools.product(*(range(len(rows)) for rows in plain.values())):
        parts = [plain[title][i] for title, i in zip(plain, picked, strict=True)]
        merged = {key: value for part in parts for key, value in part.items()}
        if len(merged) < sum(len(part) for part in parts):
            twice = [key for key in merged if sum(key in part for part in parts) > 1]
            raise ModelError(f"{twice[0]} stands in two tables. Keep it in one of them.")
        values.append(merged)
        names.append({title: labels[title][i] for title, i in zip(plain, picked, strict=True)})
    return values, tuple(names)
