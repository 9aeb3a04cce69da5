"""Tables of time, with time events.

The external object of the Modelica Standard Library counts its events. Here the next time event itself, which the model
keeps in a discrete variable, tells the interval: between events a table continues the curve of its interval, so that a
step of the integrator that reaches beyond the next event sees no kink and no jump.
"""

import dataclasses
import sys
from typing import Any

import numpy as np

from ...._errors import ModelError
from .curve import Curves, columns_of, kind_of
from .kinds import CUBIC, Extrapolation, TimeEvents, increasing, library_of

NEVER = sys.float_info.max  # the time of an event that never happens
_ROUNDING = 1e-14  # of times, relative to the largest


@dataclasses.dataclass(frozen=True, eq=False)
class TimeTable:
    """`ExternalCombiTimeTable`. All times are divided by the time scale, and abscissas count from `shift`."""

    curves: Curves
    extrapolation: Extrapolation
    start: Any
    shift: Any
    is_event: Any  # for each knot

    @classmethod
    def of(cls, table: Any, start: Any, columns: Any, smoothness: Any, extrapolation: Any, *more: Any) -> "TimeTable":
        shift, events = more
        x, y = columns_of(table, columns)
        kind, beyond, events = kind_of(smoothness, len(x)), Extrapolation(int(extrapolation)), TimeEvents(int(events))
        increasing(x, "times", strictly=kind in CUBIC)
        if isinstance(x, np.ndarray) and beyond is Extrapolation.PERIODIC and len(x) > 1 and x[0] >= x[-1]:
            raise ModelError("a periodic table of time needs a positive period.")
        return cls(Curves.through(x, y, kind), beyond, start, shift, _events(x, events))

    def next_event(self, t: Any) -> Any:
        """The time of the next event after t."""
        xp = library_of(t, self.start, self.shift, self.curves.x)
        later: Any = NEVER
        if len(self.curves.x) > 1:
            s = t - self.shift
            tolerance = self._rounding(t)
            offset = self._offset(xp.floor, s + tolerance)
            found = xp.asarray(self._event_after(s - offset + tolerance))
            later = xp.where(found < NEVER, found + offset + self.shift, NEVER)
        return xp.where(t < self.start, self.start, later)

    def value(self, column: int, t: Any, next_event: Any) -> Any:
        """The value of a column, counted from 1, in the interval that ends at the next event."""
        xp = library_of(t, next_event, self.start, self.shift, self.curves.x, self.curves.y)
        return xp.where(next_event > self.start, self._started(column - 1, t, next_event), 0.0)

    def _started(self, column: int, t: Any, next_event: Any) -> Any:
        x, y = self.curves.x, self.curves.y
        if len(x) == 1:
            return y[0, column]
        xp = library_of(t, next_event, self.shift, x)
        knots, tolerance = xp.asarray(x), self._rounding(t)
        has_next = next_event < NEVER
        # Where there is no next event, any finite time stands for it.
        end = xp.where(has_next, next_event, t) - self.shift
        offset = self._offset(lambda periods: xp.ceil(periods) - 1.0, end - tolerance)
        end, s = end - offset, t - self.shift - offset
        before, after = self._event_before(end - tolerance), xp.searchsorted(knots, end - tolerance)
        lowest = xp.clip(xp.searchsorted(knots, before + tolerance, side="right") - 1, 0, len(x) - 2)
        i = xp.clip(xp.searchsorted(knots, s, side="right") - 1, lowest, xp.maximum(after - 1, lowest))
        inside = self.curves.on(i, column, s)[0]
        if self.extrapolation is Extrapolation.PERIODIC:
            return inside
        left = self._beyond(0, column, s)
        right = self._beyond(len(x) - 1, column, s)
        return xp.where(has_next, xp.where(end <= knots[0] + tolerance, left, inside), right)

    def _beyond(self, knot: int, column: int, s: Any) -> Any:
        """The value before the first knot or after the last one."""
        x, y = self.curves.x, self.curves.y
        if self.extrapolation is Extrapolation.NONE:
            return np.nan
        if self.extrapolation is Extrapolation.HOLD:
            return y[knot, column]
        _, slope = self.curves.on(min(knot, len(x) - 2), column, x[knot])
        return y[knot, column] + slope * (s - x[knot])

    def _offset(self, rounded: Any, s: Any) -> Any:
        """The start of the period that contains s, counted from the first knot."""
        if self.extrapolation is not Extrapolation.PERIODIC:
            return 0.0
        first, period = self.curves.x[0], self.curves.x[-1] - self.curves.x[0]
        return rounded((s - first) / period) * period

    def _event_after(self, s: Any) -> Any:
        xp = library_of(s, self.curves.x)
        return xp.min(xp.where(xp.asarray(self.is_event) & (self.curves.x > s), self.curves.x, NEVER))

    def _event_before(self, s: Any) -> Any:
        xp = library_of(s, self.curves.x)
        knots = xp.asarray(self.curves.x)
        latest = xp.maximum.accumulate(xp.where(xp.asarray(self.is_event), knots, -NEVER))
        return xp.concatenate([xp.full(1, -NEVER), latest])[xp.searchsorted(knots, s)]

    def _rounding(self, t: Any) -> Any:
        xp = library_of(t, self.shift, self.curves.x)
        largest = xp.maximum(xp.abs(self.curves.x[0]), xp.abs(self.curves.x[-1])) + xp.abs(xp.asarray(self.shift))
        return _ROUNDING * (largest + xp.abs(xp.asarray(t)))


def _events(x: Any, events: TimeEvents) -> Any:
    """Whether each knot is the place of an event: the first and the last always are."""
    xp = library_of(x)
    if events is TimeEvents.ALWAYS:
        return xp.ones(len(x), bool)
    ends = np.zeros(len(x), bool)
    ends[[0, -1]] = True
    if events is TimeEvents.NEVER or len(x) == 1:
        return ends
    is_jump = x[1:] == x[:-1]
    no = xp.zeros(1, bool)
    return ends | xp.concatenate([is_jump, no]) | xp.concatenate([no, is_jump])
