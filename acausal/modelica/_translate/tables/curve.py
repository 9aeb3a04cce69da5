"""Tables of one argument."""

import dataclasses
from typing import Any

from ...._errors import ModelError
from .kinds import CUBIC, Extrapolation, Smoothness, as_array, increasing, interval, library_of, refused, within
from .slopes import slopes


def columns_of(table: Any, columns: Any) -> tuple[Any, Any]:
    """The abscissas of a table and its columns by number, counted from 1."""
    table, numbers = as_array(table), [int(column) for column in columns]
    if table.ndim != 2 or table.shape[0] < 1 or table.shape[1] < 2:
        raise ModelError(f"a table needs a row and two columns, got the shape {table.shape}.")
    if any(not 1 <= number <= table.shape[1] for number in numbers):
        raise ModelError(f"the columns {numbers} are not all in a table with {table.shape[1]} columns.")
    return table[:, 0], table[:, [number - 1 for number in numbers]]


def kind_of(smoothness: Any, rows: int) -> Smoothness:
    """The interpolation; two rows define a line only."""
    kind = Smoothness(int(smoothness))
    return Smoothness.LINEAR if rows <= 2 and kind in CUBIC else kind


@dataclasses.dataclass(frozen=True, eq=False)
class Curves:
    """Curves through the columns of y at the knots x."""

    x: Any
    y: Any
    kind: Smoothness
    slopes: Any

    @classmethod
    def through(cls, x: Any, y: Any, kind: Smoothness) -> "Curves":
        return cls(x, y, kind, slopes(x, y, kind) if kind in CUBIC else None)

    def on(self, i: Any, column: int, u: Any) -> tuple[Any, Any]:
        """The value at u of the curve of interval i, and its slope there; jumps have no width. Constant segments also
        have an interval after the last knot.
        """
        xp = library_of(i, u, self.x, self.y)
        x, y = xp.asarray(self.x), xp.asarray(self.y)[:, column]
        held, i = y[i], xp.minimum(i, len(self.x) - 2)
        h, rise = x[i + 1] - x[i], y[i + 1] - y[i]
        is_jump = h == 0.0
        h = xp.where(is_jump, 1.0, h)
        s = (u - x[i]) / h
        chord = xp.where(is_jump, 0.0, rise / h)
        if self.kind is Smoothness.CONSTANT:
            return held, chord
        if self.slopes is None:
            return xp.where(is_jump, y[i + 1], y[i] + s * rise), chord
        m = xp.asarray(self.slopes)[:, column]
        a, b = m[i] * h, m[i + 1] * h
        value = y[i] + s * (a + s * (3.0 * rise - 2.0 * a - b + s * (a + b - 2.0 * rise)))
        slope = (a + s * (2.0 * (3.0 * rise - 2.0 * a - b) + 3.0 * s * (a + b - 2.0 * rise))) / h
        return value, slope


@dataclasses.dataclass(frozen=True, eq=False)
class Table1D:
    """`ExternalCombiTable1D`."""

    curves: Curves
    extrapolation: Extrapolation

    @classmethod
    def of(cls, table: Any, columns: Any, smoothness: Any, extrapolation: Any) -> "Table1D":
        x, y = columns_of(table, columns)
        increasing(x, "abscissas", strictly=True)
        return cls(Curves.through(x, y, kind_of(smoothness, len(x))), Extrapolation(int(extrapolation)))

    def value(self, column: int, u: Any) -> Any:
        """The value of a column, counted from 1."""
        x = self.curves.x
        if len(x) == 1:
            return self.curves.y[0, column - 1]
        inside = within(u, x, self.extrapolation)
        last = len(x) - (1 if self.curves.kind is Smoothness.CONSTANT else 2)
        value, slope = self.curves.on(interval(inside, x, last), column - 1, inside)
        if self.extrapolation is Extrapolation.LINE:
            value = value + slope * (u - inside)
        return refused(value, u, inside, self.extrapolation)
