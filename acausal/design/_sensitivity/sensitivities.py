"""`sensitivities`: sensitivities of results to all parameters, as a sorted table and chart."""

from collections.abc import Mapping
from typing import Any, NamedTuple, overload

import numpy as np

from ..._analyse.table import aligned
from ..._declare.by_name import parameters
from ..._declare.component import Component
from ..._errors import SimulationError, UnknownNameError, suggestion
from ..._extras import Axes
from ..._units.display import Scale
from .._compute.evaluator import Evaluator
from .._problem.free_parameters import free_parameters
from .._problem.limits import objectives_of
from .._problem.types import Function, One

MOST = 15  # rows of a chart


class SensitivityRow(NamedTuple):
    """The sensitivity of a result to one parameter.

    `value` is in the declared `unit`, and `per_unit` is d(result)/d(parameter) in SI units per that unit; tables and
    charts use display units. `relative` is the change of the result in per cent per one per cent of the parameter, nan
    for a result of zero.
    """

    parameter: str
    unit: str
    value: float
    per_unit: float
    relative: float


class SensitivityTable(NamedTuple):
    """Sensitivities of one result to all parameters, the largest relative one first; `print` it."""

    result: str
    scale: Scale
    value: float
    rows: tuple[SensitivityRow, ...]

    def __getitem__(self, key: Any) -> Any:
        if not isinstance(key, str):
            return tuple(self)[key]
        found = {row.parameter: row for row in self.rows}
        if key not in found:
            raise UnknownNameError(f"There is no sensitivity to {key!r}.{suggestion(key, found)}")
        return found[key]

    def __str__(self) -> str:
        head = ["parameter", "value", "unit", f"change [{self.scale.unit} per unit]", "% per %"]
        rows = [self._cells(row, Scale.of(row.unit)) for row in self.rows]
        return f"{self.result} = {self.scale.value(self.value):.6g}{self.scale.text}\n{aligned([head, *rows])}"

    def _cells(self, row: SensitivityRow, scale: Scale) -> list[str]:
        change = self.scale.difference(row.per_unit) * scale.factor
        return [
            row.parameter, f"{scale.value(row.value):.5g}", scale.unit, f"{change:.5g}", f"{row.relative + 0.0:.4f}",
        ]  # fmt: skip

    def plot(self, ax: Axes | None = None, most: int = MOST) -> Axes:
        """Draws bars of the change in per cent per one per cent of each parameter; returns the axes."""
        from .sensitivity_plots import plot_sensitivities

        return plot_sensitivities(self, ax, most)


@overload
def sensitivities(model: Component, results: One, *, run: Function | None = None) -> SensitivityTable: ...
@overload
def sensitivities(
    model: Component, results: Mapping[str, One], *, run: Function | None = None
) -> dict[str, SensitivityTable]: ...
def sensitivities(
    model: Component, results: One | Mapping[str, One], *, run: Function | None = None
) -> SensitivityTable | dict[str, SensitivityTable]:
    """Sensitivities of results to all parameters of a model: a `SensitivityTable`, or one by name for several results.

        table = sensitivities(drive, (lambda s: s.t1, "ms"), run=lambda m: simulate(m, 0.5, until=...))
        print(table); table.plot()

    `results` is a function of the run, with its display unit unless it is a pure number, or a dictionary of these.
    `run` is a function of the model that returns their argument, by default the model. Derivatives are exact, from one
    compiled program.

    Raises `SimulationError` if a result cannot be computed.
    """
    objectives = {objective.name: objective for objective in objectives_of(results, "result")}
    free = free_parameters(model, {path: None for path, value in parameters(model).items() if np.size(value)})
    evaluator = Evaluator(model, free, {name: objective.function for name, objective in objectives.items()}, run)
    x = free.values(model)
    found, tables = evaluator(x), {}
    if not found.is_good:
        raise SimulationError(f"There are no sensitivities: {found.why}.")
    columns = (evaluator.owners, evaluator.names, found.values.tolist(), found.jacobian)
    for owner, name, value, slopes in zip(*columns, strict=True):
        relative = slopes * x / value if value else np.full(len(x), np.nan)
        cells = (free.names, free.units, x.tolist(), slopes.tolist(), relative.tolist())
        rows = [SensitivityRow(*row) for row in zip(*cells, strict=True)]
        rows.sort(key=lambda row: -abs(row.per_unit * row.value) if np.isnan(row.relative) else -abs(row.relative))
        tables[name] = SensitivityTable(name, objectives[owner].scale, value, tuple(rows))
    return tables if isinstance(results, Mapping) else next(iter(tables.values()))
