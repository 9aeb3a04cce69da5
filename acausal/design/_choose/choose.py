"""`choose`: the best combination of alternatives from catalogues, and all combinations with their results."""

import dataclasses
import functools as ft
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np
from jaxtyping import Bool, Float, Int

from ..._analyse.table import aligned
from ..._declare.component import Component
from ..._errors import ModelError, SimulationError, suggestion
from ..._extras import Axes, given_or_new
from .._optimise.design import Design
from .._optimise.optimise import optimise
from .._problem.limits import Limit, Objective, limits_of, objectives_of
from .._problem.types import Executor, Function, Key
from .._sweep.batches import COMPUTED, Batch, Outcomes, code_names, message_of
from .._sweep.pieces import compile_together, evaluated, store_of
from .._sweep.sweep import chunk_of
from .alternatives import DesignSpace, design_space, on_pair, run_of_pair, with_figures

M = TypeVar("M", bound=Component)
BROKEN = 1e-9  # relative violation above which a limit is broken


@dataclasses.dataclass(frozen=True)
class ChoiceProblem:
    """Objectives, constraints and run of the combinations."""

    minimise: Mapping[str, Any]
    constraints: Mapping[str, Any]
    run: Function | None
    failures: Mapping[str, str]


@dataclasses.dataclass(frozen=True, eq=False)
class Choice(Generic[M]):
    """All combinations with their results; `print` it for the best ones and the reasons against the others.

    - `values`: of the objectives, in SI units; nan for failed combinations.
    - `excess`: signed violation of each limit, relative to the limit; negative for a satisfied one.
    - `codes`: 0 for computed combinations, otherwise the reason of failure.
    - `places`: the structure of each combination, and its number within the structure.
    """

    structures: tuple[DesignSpace[M], ...]
    objectives: tuple[Objective, ...]
    limits: tuple[Limit, ...]
    values: Float[np.ndarray, "n p"]
    excess: Float[np.ndarray, "n q"]
    codes: Int[np.ndarray, " n"]
    _problem: ChoiceProblem

    @ft.cached_property
    def places(self) -> Int[np.ndarray, "n 2"]:
        """The structure of each combination, and its number within the structure."""
        pairs = [(number, i) for number, structure in enumerate(self.structures) for i in range(len(structure.x))]
        return np.array(pairs)

    def combination(self, i: int) -> dict[str, str]:
        """Names of the alternatives of a combination by table, and of its structure if there are several."""
        number, place = self.places[i].tolist()
        structure = self.structures[number]
        return ({"structure": structure.name} if structure.name else {}) | structure.named(place)

    @ft.cached_property
    def combinations(self) -> tuple[dict[str, str], ...]:
        """All combinations by name."""
        return tuple(self.combination(i) for i in range(len(self.codes)))

    def model(self, i: int) -> M:
        """The model of a combination."""
        number, place = self.places[i].tolist()
        return self.structures[number].of(place)[0]

    @property
    def is_computed(self) -> Bool[np.ndarray, " n"]:
        """Whether each combination was computed."""
        return self.codes == COMPUTED

    @property
    def is_feasible(self) -> Bool[np.ndarray, " n"]:
        """Combinations that satisfy all limits."""
        return self.is_computed & np.all(self.excess <= BROKEN, axis=1)

    @property
    def order(self) -> list[int]:
        """Feasible combinations sorted by the first objective."""
        feasible = np.flatnonzero(self.is_feasible)
        return feasible[np.argsort(self.values[feasible, 0], kind="stable")].tolist()

    @property
    def best(self) -> int | None:
        """The best feasible combination by the first objective; None if there is none."""
        return self.order[0] if self.order else None

    @property
    def front(self) -> list[int]:
        """Pareto-optimal feasible combinations."""
        found: list[int] = []
        for i in self.order:
            kept, value = self.values[found], self.values[i]
            if not np.any(np.all(kept <= value, axis=1) & np.any(kept < value, axis=1)):
                found.append(i)
        return found

    def ruled_out(self, i: int) -> tuple[str, ...]:
        """Reasons against a combination: the limits that it violates, or its failure."""
        if not self.is_computed[i]:
            code = int(self.codes[i])
            return (self._problem.failures.get(code_names()[code]) or message_of(code).split(". ")[0].rstrip("."),)
        broken = zip(self.limits, self.excess[i], strict=True)
        return tuple(f"{limit.name} {limit.text}" for limit, excess in broken if excess > BROKEN)

    @property
    def reasons(self) -> dict[str, tuple[int, int]]:
        """Number of combinations that each limit or failure rules out, in total and on its own.

        A failed combination could also violate limits, so failures never count as the only reason.
        """
        counts: dict[str, list[int]] = {}
        for i in np.flatnonzero(~self.is_feasible).tolist():
            against = self.ruled_out(i)
            for reason in against:
                pair = counts.setdefault(reason, [0, 0])
                pair[0] += 1
                pair[1] += len(against) == 1 and bool(self.is_computed[i])
        return {reason: (pair[0], pair[1]) for reason, pair in sorted(counts.items(), key=lambda item: -item[1][0])}

    def continuous(self, *paths: Key, i: int | None = None, **options: Any) -> Design[M]:
        """Continuous optimum, found by `optimise` from a combination, by default the best one.

        Each of `paths` is free between its smallest and largest value in the tables; other values and figures are those
        of the combination. The objective is the first one, with the same limits; `options` are those of `optimise`.
        Raises `ModelError` for a path in no table, and if no combination is feasible.
        """
        start = self.best if i is None else i
        if start is None:
            raise ModelError("No combination is feasible. Give the one to start from, as in continuous(..., i=0).")
        number, place = self.places[start].tolist()
        structure, problem = self.structures[number], self._problem
        model, figures = structure.of(place)
        name, stated = next(iter(problem.minimise.items()))
        function, *unit = stated if isinstance(stated, tuple) else (stated,)
        constraints = {key: (with_figures(pair[0], figures), pair[1]) for key, pair in problem.constraints.items()}
        minimise = {name: (with_figures(function, figures), *unit) if unit else with_figures(function, figures)}
        free = {path: structure.span(path) for path in paths}
        return optimise(model, free, minimise, **{"run": problem.run, "constraints": constraints, **options})

    def plot(self, ax: Axes | None = None, beside: object = None) -> Axes:
        """Draws feasible combinations over two objectives with the front, or ranked by one; returns the axes.

        `beside` adds a `Design` or values of the objectives for comparison, or several of these by name.
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


def plot_choice(choice: Choice, ax: Axes | None, beside: dict[str, np.ndarray]) -> Axes:
    """Feasible combinations over two objectives with the front, or ranked by one, with the objectives `beside`."""
    ax = given_or_new(ax, 6.5, 4.2)
    first, second = choice.objectives[0], choice.objectives[1] if len(choice.objectives) > 1 else None
    order = np.array(choice.order, int)
    ranks = np.arange(1, len(order) + 1)
    for number, structure in enumerate(choice.structures):
        own = choice.places[order, 0] == number
        x = first.scale.value(choice.values[order[own], 0])
        y = ranks[own] if second is None else second.scale.value(choice.values[order[own], 1])
        label = ", ".join(filter(None, [structure.name, "feasible"]))
        ax.plot(x, y, ".", color=f"C{number + 2}" if structure.name else "0.6", markersize=4, label=label)
    if second is not None:
        front = choice.values[choice.front]
        places = first.scale.value(front[:, 0]), second.scale.value(front[:, 1])
        ax.plot(*places, "o-", color="tab:blue", markerfacecolor="none", zorder=1, label="front")
    for (name, values), style in zip(beside.items(), ("-", "--", ":", "-.") * len(beside), strict=False):
        if second is not None and len(values) > 1:
            ax.plot(*(o.scale.value(value) for o, value in zip((first, second), values, strict=False)), "*",
                    color="tab:orange", markersize=11, label=name)  # fmt: skip
        else:
            ax.axvline(first.scale.value(values[0]), color="tab:orange", ls=style, label=name)
    ax.set_xlabel(first.scale.headed(first.name))
    ax.set_ylabel("rank" if second is None else second.scale.headed(second.name))
    ax.legend(frameon=False, fontsize="small")
    ax.grid(alpha=0.3)
    return ax


Table = Sequence[Mapping[Any, Any]]
Tables = Mapping[str, Table]


def choose(
    model: M | Mapping[str, M],
    tables: Tables | Mapping[str, Tables],
    minimise: object,
    *,
    run: Function | None = None,
    constraints: Mapping[str, object] | None = None,
    failures: Mapping[str, str] | None = None,
    store: str | Path | None = None,
    executor: Executor | None = None,
    progress: bool | None = None,
) -> Choice[M]:
    """Computes all combinations of alternatives, ranks the feasible ones, and gives the reasons against the others.

        choose(
            drive,
            {"motor": [{"name": "A", "motor.emf.k": 0.02, "motor.resistor.R": "0.3 ohm"}, {"name": "B", ...}],
             "gear": [{"gear.ratio": 5.0, "figures": {"mass": "0.3 kg"}}, ...]},
            {"time": (lambda s: s.t1, "ms"), "mass": (lambda s, parts: parts["gear"]["mass"], "g")},
            run=lambda m: simulate(m, 0.5, until=lambda s: s.load.b.phi - 0.8, save="end"),
            constraints={"final speed": (lambda s: s.final.load.w, "<= 100 rpm")},
        )

    - `model`: a model, or several by name with different structures, such as one with a cam and one with a pump. Each
      has its own tables by that name, and runs as its own batch.
    - `tables`: tables by title. A table is a list of dictionaries with values by path (or a `pandas.DataFrame`), with
      the same paths in all rows and an optional "name". Values are in declared units, quantities or texts with a unit.
      "figures" are numbers that are not parameters of the model: a mass, a price, a largest speed.
    - `minimise`, `run`, `constraints`: as in `optimise`. The first of several objectives ranks the combinations, and
      all of them define the front. A function of two arguments also receives the figures, by table and name, in SI
      units.
    - `failures`: reasons against combinations whose run fails, by the name of the `Result`:
      `{"never_stopped": "not open within 150 ms"}`.
    - `store`, `executor`, `progress`: as in `sweep`; each of several models has its own store in the folder.

    Raises `ModelError` or `ParameterError` for invalid tables, and `SimulationError` if no combination can be computed.
    """
    objectives, limits = objectives_of(minimise), limits_of(constraints)
    if unknown := [name for name in failures or {} if name not in code_names()]:
        raise ModelError(f"{unknown[0]!r} is not a failure.{suggestion(unknown[0], code_names())}")
    if twice := [o.name for o in objectives if o.name in limits]:
        raise ModelError(f"{twice[0]} is the name of an objective and of a constraint. Rename one.")
    structures = _structures(model, tables)
    functions = {o.name: on_pair(o.function) for o in objectives}
    functions |= {name: on_pair(function) for name, (function, _) in limits.items()}
    of_pair = None if run is None else ft.partial(run_of_pair, run)
    batches = [Batch(one.model, one.variables, functions, of_pair) for one in structures]
    columns = [batch.columns for batch in batches]
    owners = columns[0][1]
    for structure, (_, own) in zip(structures, columns, strict=True):
        _check_owners(structure, own, owners, objectives)
    for batch in batches:
        batch.progress = progress
    if executor is None:
        compile_together(batches, [structure.x for structure in structures])
    found: list[Outcomes] = []
    for structure, batch, (names, _) in zip(structures, batches, columns, strict=True):
        if found and not np.all(found[-1].are_finished):
            found.append(Outcomes.interrupted(len(structure.x), len(names)))
            continue
        size = chunk_of(len(structure.x))
        path = Path(store) / structure.name if store is not None and structure.name else store
        kept = store_of(path, batch, names, structure.x, size)
        what = " of ".join(filter(None, ["combinations", structure.name]))
        found.append(evaluated(batch, structure.x, what, executor=executor, chunk=size, store=kept, progress=progress))
    results, codes = np.concatenate([one.values for one in found]), np.concatenate([one.codes for one in found])
    if not np.any(codes == COMPUTED):
        raise SimulationError(f"None of {len(codes)} combinations could be computed: {message_of(int(codes[0]))}")
    values = np.where((codes == COMPUTED)[:, None], results[:, [owners.index(o.name) for o in objectives]], np.nan)
    stated = [(limits[owner][1], i) for i, owner in enumerate(owners) if owner in limits]
    excess = [np.asarray(limit.excess(results[:, i])) for limit, i in stated]
    table = np.stack(excess, axis=1) if excess else np.zeros((len(codes), 0))
    problem = ChoiceProblem(
        minimise if isinstance(minimise, Mapping) else {"objective": minimise}, constraints or {}, run, failures or {}
    )
    return Choice(structures, objectives, tuple(limit for limit, _ in stated), values, table, codes, problem)


def _structures(model: Any, tables: Any) -> tuple[DesignSpace, ...]:
    if not isinstance(model, Mapping):
        return (design_space("", model, tables),)
    if not model or not isinstance(tables, Mapping) or model.keys() != tables.keys():
        raise ModelError(f"Give the tables of several models by the names of the models: {', '.join(model)}.")
    return tuple(design_space(name, one, tables[name]) for name, one in model.items())


def _check_owners(
    structure: DesignSpace, own: Sequence[str], first: Sequence[str], objectives: Sequence[Objective]
) -> None:
    for name in (objective.name for objective in objectives):
        if own.count(name) != 1:
            raise ModelError(f"{name} must return one number, but returned {own.count(name)}.")
    if other := [name for name in own if own.count(name) != first.count(name)]:
        raise ModelError(
            f"{other[0]} returned {own.count(other[0])} numbers for {structure.name}, but {first.count(other[0])} "
            "for the first model. Return equally many."
        )
