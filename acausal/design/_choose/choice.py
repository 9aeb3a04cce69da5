"""Result of `choose`: all combinations with their results."""

import dataclasses
import functools as ft
from collections.abc import Mapping
from typing import Any, Generic, TypeVar

import numpy as np
from jaxtyping import Bool, Float, Int

from ..._analyse.table import aligned
from ..._declare.component import Component
from ..._errors import ModelError
from ..._extras import Axes, given_or_new
from .._optimise.design import Design
from .._optimise.optimise import optimise
from .._problem.limits import Limit, Objective
from .._problem.types import Function, Key
from .._sweep.batches import COMPUTED, code_names, message_of
from .alternatives import DesignSpace, with_figures

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
