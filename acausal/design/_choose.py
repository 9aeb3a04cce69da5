"""`choose`: the best combination of what catalogues offer."""

import dataclasses
import functools as ft
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from .._analyse.table import aligned
from .._declare.component import Component
from .._errors import ModelError, SimulationError, suggestion
from .._extras import Axes
from ._alternatives import Structure, held, on_pair, run_of_pair, structure_of
from ._bar import bar
from ._batches import COMPUTED, Outcomes, Task, code_names, said
from ._choice_plot import plot_choice
from ._design import Design
from ._limits import Limit, Objective, limits_of, objectives_of
from ._optimise import optimise
from ._pieces import compile_together, evaluated
from ._store import store_of
from ._sweep import chunk_of

Table = Sequence[Mapping[Any, Any]]
Tables = Mapping[str, Table]
BROKEN = 1e-9  # share of a limit from which on it is broken


@dataclasses.dataclass(frozen=True)
class Asked:
    """What was asked of the combinations."""

    minimise: Mapping[str, Any]
    constraints: Mapping[str, Any]
    run: Callable[[Any], Any] | None
    failures: Mapping[str, str]


@dataclasses.dataclass(frozen=True, eq=False)
class Choice:
    """All combinations with their results; `print` it for the best of them and what ruled the others out.

    - `values`: of the objectives, in SI units; not a number for what could not be computed.
    - `excess`: by how much each limit is broken, as a fraction of it; negative inside of it.
    - `codes`: 0 for combinations that were computed; of the others, why not.
    - `places`: the structure of each combination, and which one of it.
    """

    structures: tuple[Structure, ...]
    objectives: tuple[Objective, ...]
    limits: tuple[Limit, ...]
    values: Float[np.ndarray, "n p"]
    excess: Float[np.ndarray, "n q"]
    codes: Int[np.ndarray, " n"]
    _asked: Asked

    @ft.cached_property
    def places(self) -> Int[np.ndarray, "n 2"]:
        pairs = [(number, i) for number, structure in enumerate(self.structures) for i in range(len(structure.x))]
        return np.array(pairs)

    def combination(self, i: int) -> dict[str, str]:
        """The names of the alternatives of a combination by table, with that of its structure where there are some."""
        number, place = self.places[i].tolist()
        structure = self.structures[number]
        return ({"structure": structure.name} if structure.name else {}) | structure.named(place)

    @ft.cached_property
    def combinations(self) -> tuple[dict[str, str], ...]:
        """All of them by name."""
        return tuple(self.combination(i) for i in range(len(self.codes)))

    def model(self, i: int) -> Any:
        """The model of a combination."""
        number, place = self.places[i].tolist()
        return self.structures[number].of(place)[0]

    @property
    def is_computed(self) -> Bool[np.ndarray, " n"]:
        return self.codes == COMPUTED

    @property
    def is_feasible(self) -> Bool[np.ndarray, " n"]:
        """Combinations that keep all limits."""
        return self.is_computed & np.all(self.excess <= BROKEN, axis=1)

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
            code = int(self.codes[i])
            return (self._asked.failures.get(code_names()[code]) or said(code).split(". ")[0].rstrip("."),)
        broken = zip(self.limits, self.excess[i], strict=True)
        return tuple(f"{limit.name} {limit.text}" for limit, excess in broken if excess > BROKEN)

    @property
    def reasons(self) -> dict[str, tuple[int, int]]:
        """By limit or failure: how many combinations it rules out, and how many it alone does.

        Of what could not be computed, nobody knows which limits it would break: no failure is counted as alone.
        """
        counts: dict[str, list[int]] = {}
        for i in np.flatnonzero(~self.is_feasible).tolist():
            against = self.ruled_out(i)
            for reason in against:
                pair = counts.setdefault(reason, [0, 0])
                pair[0] += 1
                pair[1] += len(against) == 1 and bool(self.is_computed[i])
        return {reason: (pair[0], pair[1]) for reason, pair in sorted(counts.items(), key=lambda item: -item[1][0])}

    def continuous(self, *paths: Any, i: int | None = None, **options: Any) -> Design:
        """The continuous optimum: what `optimise` finds from a combination on, by default the best one.

        Each of `paths` is free between the least and the largest value that the tables offer for it; other values and
        figures stay those of the combination. The first objective is minimised within the same limits; `options` are
        those of `optimise`. Raises `ModelError` for a path that no table holds, and where no combination is feasible.
        """
        start = self.best if i is None else i
        if start is None:
            raise ModelError("No combination is feasible: name the one to begin with, as in continuous(..., i=0).")
        number, place = self.places[start].tolist()
        structure, asked = self.structures[number], self._asked
        model, figures = structure.of(place)
        name, stated = next(iter(asked.minimise.items()))
        function, *unit = stated if isinstance(stated, tuple) else (stated,)
        constraints = {key: (held(pair[0], figures), pair[1]) for key, pair in asked.constraints.items()}
        minimise = {name: (held(function, figures), *unit) if unit else held(function, figures)}
        free = {path: structure.span(path) for path in paths}
        return optimise(model, free, minimise, **{"run": asked.run, "constraints": constraints, **options})

    def plot(self, ax: Axes | None = None, beside: Any = None) -> Any:
        """Feasible combinations by two objectives with the front, or in order by one.

        - `beside`: what to compare: a `Design`, values of the objectives, or several of these by name.

        Returns the matplotlib axes.
        """
        named = beside if isinstance(beside, Mapping) else {} if beside is None else {"continuous optimum": beside}
        values = {
            name: np.ravel(np.asarray(one.objective if isinstance(one, Design) else one, float))
            for name, one in named.items()
        }
        return plot_choice(self, ax, values)

    def __repr__(self) -> str:
        return f"<Choice among {len(self.codes)} combinations, {int(np.sum(self.is_feasible))} feasible>"

    def __str__(self) -> str:
        ranked = [(str(rank), i, self.combination(i)) for rank, i in enumerate(self.order[:10], start=1)]
        heads = list(dict.fromkeys(title for *_, named in ranked for title in named))
        rows = [[rank, *(named.get(title, "") for title in heads), *self._shown(i)] for rank, i, named in ranked]
        lines = [f"{len(self.codes)} combinations, {int(np.sum(self.is_feasible))} feasible"]
        results = [objective.scale.headed(objective.name) for objective in self.objectives]
        lines += [aligned([["", *heads, *results], *rows])] if rows else []
        failures = {self.ruled_out(i)[0] for i in np.flatnonzero(~self.is_computed).tolist()}
        for reason, (number, alone) in self.reasons.items():
            more = "and not judged further" if reason in failures else f"{alone} of them by it alone"
            lines.append(f"ruled out by {reason}: {number}, {more}")
        return "\n".join(lines)

    def _shown(self, i: int) -> list[str]:
        return [f"{o.scale.value(value):.5g}" for o, value in zip(self.objectives, self.values[i], strict=True)]


def choose(
    model: Component | Mapping[str, Component],
    tables: Tables | Mapping[str, Tables],
    minimise: Any,
    *,
    run: Callable[[Any], Any] | None = None,
    constraints: Mapping[str, Any] | None = None,
    failures: Mapping[str, str] | None = None,
    store: str | Path | None = None,
    executor: Any = None,
    progress: bool | None = None,
) -> Choice:
    """Run all combinations of what tables offer, and say which are feasible, which is best and what rules others out.

        choose(
            drive,
            {"motor": [{"name": "A", "motor.emf.k": 0.02, "motor.resistor.R": "0.3 ohm"}, {"name": "B", ...}],
             "gear": [{"gear.ratio": 5.0, "figures": {"mass": "0.3 kg"}}, ...]},
            {"time": (lambda s: s.t1, "ms"), "mass": (lambda s, parts: parts["gear"]["mass"], "g")},
            run=lambda m: simulate(m, 0.5, until=lambda s: s.load.b.phi - 0.8, save="end"),
            constraints={"final speed": (lambda s: s.final.load.w, "<= 100 rpm")},
        )

    - `model`: a model, or several of them by name, which differ in their structure, such as one with a cam and one
      with a pump; each has tables of its own by that name, and is run as a batch of its own.
    - `tables`: alternatives by what they are for, each a dictionary of values by path (or a `pandas.DataFrame`), with
      its "name" if it has one. Values are in declared units, quantities or texts with a unit. The rows of a table name
      the same paths. "figures" are what the model has no parameter for: a mass, a price, a largest speed.
    - `minimise`, `run`, `constraints`: as in `optimise`; with several objectives, the first one ranks and all of them
      make the front. A function of two arguments is given the figures as well, by table and name, in SI units.
    - `failures`: what it means if a run fails, by the name of the `Result`, where it is said what rules a combination
      out: `{"never_stopped": "not open within 150 ms"}`.
    - `store`, `executor`, `progress`: as in `sweep`; of several models, each has a store of its own in the folder.

    Raises `ModelError` or `ParameterError` for what is wrong with tables, and `SimulationError` where no combination
    can be computed.
    """
    objectives, limits = objectives_of(minimise), limits_of(constraints)
    if unknown := [name for name in failures or {} if name not in code_names()]:
        raise ModelError(f"{unknown[0]!r} is no failure.{suggestion(unknown[0], code_names())}")
    if twice := [o.name for o in objectives if o.name in limits]:
        raise ModelError(f"{twice[0]} is the name of an objective and of a constraint. Rename one.")
    structures = _structures(model, tables)
    functions = {o.name: on_pair(o.function) for o in objectives}
    functions |= {name: on_pair(function) for name, (function, _) in limits.items()}
    tasks = [Task(one.model, one.part, functions, ft.partial(run_of_pair, run)) for one in structures]
    columns = [task.columns() for task in tasks]
    owners = columns[0][1]
    for structure, (_, own) in zip(structures, columns, strict=True):
        _check_owners(structure, own, owners, objectives)
    if executor is None:
        compile_together(tasks, [structure.x for structure in structures])
    found: list[Outcomes] = []
    for structure, task, (names, _) in zip(structures, tasks, columns, strict=True):
        size = chunk_of(len(structure.x))
        path = Path(store) / structure.name if store is not None and structure.name else store
        kept = store_of(path, task, names, structure.x, size)
        tell = bar(" of ".join(filter(None, ["combinations", structure.name])), progress)
        found.append(evaluated(task, structure.x, executor=executor, chunk=size, store=kept, progress=tell))
    results, codes = np.concatenate([one.values for one in found]), np.concatenate([one.codes for one in found])
    if not np.any(codes == COMPUTED):
        raise SimulationError(f"None of {len(codes)} combinations could be computed: {said(int(codes[0]))}")
    values = np.where((codes == COMPUTED)[:, None], results[:, [owners.index(o.name) for o in objectives]], np.nan)
    stated = [(limits[owner][1], i) for i, owner in enumerate(owners) if owner in limits]
    excess = [_excess(limit, results[:, i]) for limit, i in stated]
    table = np.stack(excess, axis=1) if excess else np.zeros((len(codes), 0))
    asked = Asked(
        minimise if isinstance(minimise, Mapping) else {"objective": minimise}, constraints or {}, run, failures or {}
    )
    return Choice(structures, objectives, tuple(limit for limit, _ in stated), values, table, codes, asked)


def _structures(model: Any, tables: Any) -> tuple[Structure, ...]:
    if not isinstance(model, Mapping):
        return (structure_of("", model, tables),)
    if not model or not isinstance(tables, Mapping) or model.keys() != tables.keys():
        raise ModelError(f"Of several models, each has tables by its name: {', '.join(model)}.")
    return tuple(structure_of(name, one, tables[name]) for name, one in model.items())


def _check_owners(structure: Structure, own: Sequence[str], first: Sequence[str], objectives: Any) -> None:
    for name in (objective.name for objective in objectives):
        if own.count(name) != 1:
            raise ModelError(f"{name} returned {own.count(name)} numbers: what is minimised is one.")
    if other := [name for name in own if own.count(name) != first.count(name)]:
        raise ModelError(
            f"{other[0]} returned {own.count(other[0])} numbers of {structure.name}, but {first.count(other[0])} "
            "of the models before. Return as many of each."
        )


def _excess(limit: Limit, values: np.ndarray) -> np.ndarray:
    excess = np.asarray(limit.excess(values))
    return np.abs(excess) if limit.is_equation else excess
