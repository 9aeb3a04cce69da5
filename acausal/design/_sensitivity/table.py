"""A sorted table and chart of the sensitivities of a result."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..._analyse.table import aligned
from ..._errors import UnknownNameError, suggestion
from ..._extras import Axes
from ..._units.display import Scale

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
        from .sensitivity_plots import plot_sensitivities

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
