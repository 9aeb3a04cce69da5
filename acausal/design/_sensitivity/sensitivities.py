"""`sensitivities`: sensitivities of results to all parameters, as a sorted table and chart."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, overload

import numpy as np

from ..._analyse.table import aligned
from ..._declare.by_name import parameters
from ..._declare.component import Component
from ..._errors import SimulationError, UnknownNameError, suggestion
from ..._extras import Axes, given_or_new
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
    """Sensitivities of one result to parameters, the largest relative one first; `print` it."""

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

        return plot_sensitivities(self, ax, most)


def sensitivity_table(
    result: str, scale: Scale, value: float, parameters: Sequence[tuple[str, str, float, float]]
) -> SensitivityTable:
    """The table of a result with a value, for parameters by name, unit, value and derivative."""
    rows = [
        SensitivityRow(name, unit, number, slope, slope * number / value if value else np.nan)
        for name, unit, number, slope in parameters
    ]
    rows.sort(key=lambda row: -abs(row.per_unit * row.value) if np.isnan(row.relative) else -abs(row.relative))
    return SensitivityTable(result, scale, value, tuple(rows))


def plot_sensitivities(table: SensitivityTable, ax: Axes | None, most: int) -> Axes:
    """Bars of the `most` largest changes in per cent for one per cent of a parameter."""
    rows = [row for row in table.rows if row.relative][:most][::-1]
    ax = given_or_new(ax, 7.5, 1.2 + 0.3 * len(rows))
    colours = ["tab:red" if row.relative > 0.0 else "tab:blue" for row in rows]
    ax.barh([row.parameter for row in rows], [row.relative for row in rows], color=colours)
    for i, row in enumerate(rows):
        scale = Scale.of(row.unit)
        ax.annotate(f" {scale.value(row.value):.4g}{scale.text} ", (row.relative, i), va="center", fontsize="small",
                    ha="left" if row.relative > 0.0 else "right")  # fmt: skip
    ax.axvline(0.0, color="black", linewidth=0.8)
    ax.margins(x=0.25)
    ax.set_xlabel(f"change of {table.result} in % for 1 % of the parameter")
    ax.set_title(f"{table.result} = {table.scale.value(table.value):.5g}{table.scale.text}", fontsize="medium")
    ax.grid(axis="x", alpha=0.3)
    return ax


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
        rows = list(zip(free.names, free.units, x.tolist(), slopes.tolist(), strict=True))
        tables[name] = sensitivity_table(name, objectives[owner].scale, value, rows)
    return tables if isinstance(results, Mapping) else next(iter(tables.values()))
