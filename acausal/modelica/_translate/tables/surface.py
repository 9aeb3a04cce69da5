"""Tables of two arguments."""

import dataclasses
from typing import Any

from ...._errors import ModelError
from .kinds import Extrapolation, Smoothness, as_array, increasing, interval, library_of, refused, within
from .slopes import akima, chords, lengthened, weights


def _twist(x: Any, y: Any, z: Any) -> Any:
    """The mixed derivatives at the knots of the surface of Akima (1974)."""
    along_x, along_y = chords(x, z), chords(y, z.T).T
    cells = chords(x, along_y)  # the mixed differences of the cells
    whole = lengthened(lengthened(cells, 1).T, 1).T
    x_before, x_after = weights(lengthened(along_x, 2))
    y_before, y_after = (w.T for w in weights(lengthened(along_y.T, 2)))
    before = y_before * whole[:-1, :-1] + y_after * whole[:-1, 1:]
    after = y_before * whole[1:, :-1] + y_after * whole[1:, 1:]
    return (x_before * before + x_after * after) / ((x_before + x_after) * (y_before + y_after))


def _hermite(u: Any, knots: Any, i: Any) -> Any:
    """The weights of the two values and the two slopes at the ends of interval i."""
    h = knots[i + 1] - knots[i]
    s = (u - knots[i]) / h
    rest, xp = 1.0 - s, library_of(u, knots, i)
    return xp.stack(
        [rest**2 * (1.0 + 2.0 * s), s**2 * (3.0 - 2.0 * s), h * s * rest**2, -h * s**2 * rest],
    )


def _hermite_slope(u: Any, knots: Any, i: Any) -> Any:
    """The derivatives of these weights."""
    h = knots[i + 1] - knots[i]
    s = (u - knots[i]) / h
    xp = library_of(u, knots, i)
    rise = 6.0 * s * (1.0 - s) / h
    return xp.stack([-rise, rise, (1.0 - s) * (1.0 - 3.0 * s), s * (3.0 * s - 2.0)])


@dataclasses.dataclass(frozen=True, eq=False)
class Table2D:
    """`ExternalCombiTable2D`: values z at the knots x and y, with their derivatives if the surface is smooth."""

    x: Any
    y: Any
    z: Any
    kind: Smoothness
    extrapolation: Extrapolation
    derivatives: tuple[Any, Any, Any] | None

    @classmethod
    def of(cls, table: Any, smoothness: Any, extrapolation: Any) -> "Table2D":
        table, kind = as_array(table), Smoothness(int(smoothness))
        if table.ndim != 2 or min(table.shape) < 2:
            raise ModelError(f"a table of two arguments needs two rows and columns, got the shape {table.shape}.")
        x, y, z = table[1:, 0], table[0, 1:], table[1:, 1:]
        increasing(x, "first column", strictly=True)
        increasing(y, "first row", strictly=True)
        if kind not in (Smoothness.LINEAR, Smoothness.AKIMA, Smoothness.CONSTANT):
            raise ModelError("a table of two arguments has no monotone or modified cubics; choose another smoothness.")
        if kind is Smoothness.AKIMA and max(len(x), len(y)) <= 2:
            kind = Smoothness.LINEAR
        found = None
        if kind is Smoothness.AKIMA:
            zero = z * 0.0
            by_x = akima(x, z) if len(x) > 1 else zero
            by_y = akima(y, z.T).T if len(y) > 1 else zero
            found = (by_x, by_y, _twist(x, y, z) if min(z.shape) > 1 else zero)
        return cls(x, y, z, kind, Extrapolation(int(extrapolation)), found)

    def value(self, u: Any, v: Any) -> Any:
        xp = library_of(u, v, self.x, self.y, self.z)
        x, y = xp.asarray(self.x), xp.asarray(self.y)
        # A single row or column holds everywhere.
        u, v = (x[0] if len(x) == 1 else u), (y[0] if len(y) == 1 else v)
        u_in, v_in = within(u, x, self.extrapolation), within(v, y, self.extrapolation)
        i, by_x = self._weights(u, u_in, x)
        j, by_y = self._weights(v, v_in, y)
        value = by_x @ self._corners(i, j, xp) @ by_y
        if self.kind is Smoothness.CONSTANT:
            at = xp.asarray(self.z)[_at_or_after(u_in, x, i), _at_or_after(v_in, y, j)]
            is_line = (u != u_in) | (v != v_in) if self.extrapolation is Extrapolation.LINE else xp.asarray(False)
            value = xp.where(is_line, value, at)
        return refused(refused(value, u, u_in, self.extrapolation), v, v_in, self.extrapolation)

    def _weights(self, u: Any, inside: Any, knots: Any) -> tuple[Any, Any]:
        """The interval of an argument, and the weights of the data at its ends."""
        xp = library_of(u, knots)
        smooth = self.derivatives is not None
        if len(knots) == 1:
            return xp.asarray(0), xp.eye(4 if smooth else 2)[0]
        i = interval(inside, knots, len(knots) - 2)
        beyond = u - inside if self.extrapolation is Extrapolation.LINE else xp.asarray(0.0)
        if smooth:
            return i, _hermite(inside, knots, i) + beyond * _hermite_slope(inside, knots, i)
        share = (inside + beyond - knots[i]) / (knots[i + 1] - knots[i])
        return i, xp.stack([1.0 - share, share])

    def _corners(self, i: Any, j: Any, xp: Any) -> Any:
        """The data at the corners of a cell: values, then slopes, by rows and columns."""

        def block(data: Any) -> Any:
            after_i, after_j = xp.minimum(i + 1, len(self.x) - 1), xp.minimum(j + 1, len(self.y) - 1)
            data = xp.asarray(data)
            rows = [[data[i, j], data[i, after_j]], [data[after_i, j], data[after_i, after_j]]]
            return xp.stack([xp.stack(row) for row in rows])

        if self.derivatives is None:
            return block(self.z)
        by_x, by_y, twist = self.derivatives
        return xp.block([[block(self.z), block(by_y)], [block(by_x), block(twist)]])


def _at_or_after(u: Any, knots: Any, i: Any) -> Any:
    return i + (u >= knots[i + 1]) if len(knots) > 1 else i
