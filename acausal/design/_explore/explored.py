"""The results of a model at some values of its free parameters, with limits, gradients and curves."""

import dataclasses
import functools as ft
import json
from collections.abc import Iterator, Sequence
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

from ..._analyse.table import aligned
from ..._declare.component import Component
from ..._extras import Figure, needed
from ..._integrate.results.columns import Column, Item, columns
from ..._integrate.results.solution import Solution
from ..._units.display import Scale
from .._optimise.entries import LimitedResult
from .._problem.free import Free, Variable
from .._problem.limits import Limit

M = TypeVar("M", bound=Component, covariant=True)


class ExploredResult(NamedTuple):
    """A result in SI units, or in the unit that its function returns.

    `gradient` holds its derivatives with respect to the free parameters in their declared units.
    """

    name: str
    value: float
    scale: Scale
    gradient: np.ndarray
    limit: Limit | None = None

    @property
    def text(self) -> str:
        """The value in its display unit."""
        return f"{self.scale.value(self.value):.5g}{self.scale.text}"

    @property
    def limited(self) -> LimitedResult | None:
        """The result with its limit and margin; None without a limit."""
        return None if self.limit is None else LimitedResult(self.limit, self.value)

    def per_unit(self, i: int, variable: Variable) -> float:
        """The change for one more unit of the i-th parameter, in display units: ms per mm."""
        return float(self.scale.difference(self.gradient[i])) * variable.scale.factor

    def per_percent(self, i: int, x: float) -> float:
        """The change for one per cent more of the i-th parameter, whose value is `x`, in the display unit."""
        return float(self.scale.difference(0.01 * x * self.gradient[i]))


@dataclasses.dataclass(frozen=True, eq=False)
class Explored(Generic[M]):
    """Results of a model at some values of its free parameters; `print` it.

    - `values`: the free parameters by name, in their declared units.
    - `results`: results with limits and gradients. Empty if they cannot be computed; `message` then states the reason.
    - `solution`: the run with its trajectories; None without a run, or if the run failed.
    """

    free: Free
    x: np.ndarray
    results: tuple[ExploredResult, ...] = ()
    solution: Solution[M] | None = None
    message: str = ""
    _curves: tuple[Item, ...] = ()
    _units: Sequence[str] = ()

    @property
    def values(self) -> dict[str, float]:
        """The free parameters by name, in their declared units."""
        return dict(zip(self.free.names, self.x.tolist(), strict=True))

    @property
    def is_good(self) -> bool:
        """Whether the results could be computed."""
        return not self.message

    @property
    def broken(self) -> tuple[str, ...]:
        """Names of the results that violate their limits."""
        return tuple(one.name for one in self.results if one.limited is not None and one.limited.is_broken)

    def __getitem__(self, name: str) -> ExploredResult:
        return {one.name: one for one in self.results}[name]

    @ft.cached_property
    def _columns(self) -> list[Column]:
        """The curves over `solution.ts`."""
        return columns(self.solution, self._curves, self._units) if self.solution is not None and self._curves else []

    def figure(self) -> Figure:
        """Draws the curves, one panel for each unit; returns a matplotlib figure that pyplot does not know."""
        count = max(len({column.unit for column in self._columns}), 1)
        figure = needed("matplotlib.figure", "explore", "A picture").Figure(
            (7.0, 1.0 + 1.7 * count), layout="constrained"
        )
        if self.solution is not None and self._curves:
            panels = np.ravel(figure.subplots(count, 1, sharex=True))
            self.solution.plot(*self._curves, units=self._units, axes=panels)
        return figure

    def result_rows(self) -> list[tuple[str, ...]]:
        """Rows of a table of the results: name, value, limit, margin, verdict."""
        limits = [one.limited for one in self.results]
        cells = [("", "", "") if limited is None else limited.row()[2:] for limited in limits]
        return [(one.name, one.text, *row) for one, row in zip(self.results, cells, strict=True)]

    def gradient_rows(self, name: str) -> list[tuple[str, ...]]:
        """Rows of a table of the gradient of a result: parameter, value, change per unit and per one per cent."""
        result = self[name]
        return [
            (
                variable.name,
                variable.text(x),
                f"{result.per_unit(i, variable):+.4g}",
                f"{result.per_percent(i, x):+.4g}",
            )
            for i, (variable, x) in enumerate(zip(self.free.variables, self.x.tolist(), strict=True))
        ]

    def to_json(self) -> str:
        """Values and results as JSON: values in declared units, results in SI units, each with its unit."""
        units = dict(zip(self.free.names, self.free.units, strict=True))
        described: dict[str, Any] = {
            "values": {name: {"value": value, "unit": units[name]} for name, value in self.values.items()},
            "results": {one.name: _described(one) for one in self.results},
        }
        return json.dumps(described | ({"message": self.message} if self.message else {}), indent=2)

    def __str__(self) -> str:
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        if self.message:
            yield self.message
        if not self.results:
            yield self.free.text(self.x)
            return
        yield aligned([("result", "value", "limit", "margin", ""), *self.result_rows()])
        first = self.results[0]
        yield ""
        head = ("parameter", "value", f"one unit more [{first.scale.unit}]", f"1 % more [{first.scale.unit}]")
        yield aligned([head, *self.gradient_rows(first.name)])


def _described(one: ExploredResult) -> dict[str, Any]:
    """A result for a JSON file."""
    limited = one.limited
    shown = {"value": one.value, "shown": one.text}
    return shown if limited is None else {**shown, "limit": limited.limit.text, "margin": limited.margin}
