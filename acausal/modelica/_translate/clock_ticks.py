"""Ticks of clocks as events of the engine.

The clocks of one base have their ticks on a common grid, by whole numbers, so that ticks that coincide do so exactly.
A discrete variable holds the number of the present tick on this grid; ticks at which no clock is active are left out.
"""

import dataclasses
import math
from collections.abc import Iterable
from fractions import Fraction
from typing import Any

from ..._errors import ModelError
from .._syntax import expressions as e
from .clock_inference import Base, Clock

TIME = e.Ref("time")


@dataclasses.dataclass(frozen=True)
class Tick:
    """An event at a time, or when a condition becomes true, or at the start of a run, that sets discrete variables."""

    kind: str  # "at", "when" or "started"
    of: Any
    changes: dict[str, Any]


class Grid:
    """The ticks of all clocks of a base. `number` is the name of the variable that holds the number of the tick."""

    def __init__(self, base: Base, clocks: Iterable[Clock], number: str) -> None:
        own = {clock for clock in clocks if clock.base == base}
        self.base = base
        self.step = _common([x for clock in own for x in (clock.interval, clock.offset)])
        if base.condition is not None:
            if self.step.denominator != 1:
                raise ModelError("an event clock cannot be super-sampled or shifted by a fraction of its interval.")
            self.step = Fraction(1)
        self.places = {self.place(clock) for clock in own}
        self.number, self.coming, self.origin = number, f"{number}_next", f"{number}_start"
        self.changes: dict[str, Any] = {}

    def place(self, clock: Clock) -> tuple[int, int]:
        """The interval and the first tick of a clock on the grid."""
        return int(clock.interval / self.step), int(clock.offset / self.step)

    @property
    def tick(self) -> Any:
        """The number of the tick at which the event of the grid happens."""
        return binary("Add", e.Ref(self.number), 1) if self.base.condition is not None else e.Ref(self.coming)

    @property
    def time(self) -> Any:
        """The time of this event. That of the run exceeds it by a rounding error, except at the start."""
        if self.base.condition is not None:
            return TIME
        return e.If(((binary("Lt", e.Ref(self.number), 0), TIME),), self._due)

    @property
    def _due(self) -> Any:
        return binary("Add", e.Ref(self.origin), _times(self.step, self.base.interval, e.Ref(self.coming)))

    def is_active(self, clock: Clock, number: Any = None) -> Any:
        """Whether a tick, by default the last one, is a tick of the clock."""
        number = e.Ref(self.number) if number is None else number
        interval, first = self.place(clock)
        begun = binary("Ge", number, first)
        if interval == 1:
            return begun
        turn = binary("Eq", e.Builtin("Mod", (binary("Sub", number, first), e.Const(interval))), 0)
        return binary("And", begun, turn) if first else binary("And", binary("Ge", number, 0), turn)

    def has_begun(self, clock: Clock) -> Any:
        return binary("Ge", e.Ref(self.number), self.place(clock)[1])

    def is_first(self, clock: Clock, number: Any = None) -> Any:
        """Whether the clock has ticked at most once."""
        return binary("Lt", e.Ref(self.number) if number is None else number, sum(self.place(clock)))

    def set_at_ticks(self, clock: Clock, name: str, value: Any) -> None:
        """The discrete variable gets the value that an expression has just before each tick of the clock."""
        is_only = self.places == {(1, 0)}
        self.changes[name] = value if is_only else e.If(((self.is_active(clock, self.tick), value),), e.Ref(name))

    def interval(self, clock: Clock) -> Any:
        """The interval of a clock that is no event clock."""
        return _times(clock.interval, self.base.interval)

    # Events

    def starts(self) -> dict[str, float]:
        """The discrete variables with their start values."""
        if self.base.condition is not None:
            return {self.number: -1.0}
        return {self.number: -1.0, self.coming: float(min(first for _, first in self.places)), self.origin: math.inf}

    def ticks(self) -> list[Tick]:
        changes = {self.number: self.tick, **self.changes}
        if self.base.condition is not None:
            return [Tick("when", self.base.condition, changes)]
        changes[self.coming] = self._following()
        return [Tick("at", self._due, changes), Tick("started", None, {self.origin: TIME})]

    def _following(self) -> Any:
        """The number of the next tick at which a clock is active."""
        number = e.Ref(self.coming)
        nexts = []
        for interval, first in sorted(self.places):
            passed = e.Builtin("Floor", (binary("Div", binary("Sub", number, first), interval),))
            later = binary("Add", binary("Mul", binary("Add", passed, 1), interval), first)
            nexts.append(e.If(((binary("Lt", number, first), e.Const(first)),), later))
        found = nexts[0]
        for item in nexts[1:]:
            found = e.Builtin("Min", (found, item))
        return found


def binary(op: str, left: Any, right: Any) -> e.Binary:
    return e.Binary(op, left, e.Const(right) if isinstance(right, int) else right)


def _times(ratio: Fraction, *factors: Any) -> Any:
    """A product with a ratio of whole numbers, rounded once if the factors are whole numbers, too."""
    found: Any = e.Const(ratio.numerator)
    for factor in factors:
        found = binary("Mul", found, factor)
    return binary("Div", found, ratio.denominator)


def _common(values: list[Fraction]) -> Fraction:
    """The greatest common divisor."""
    scale = math.lcm(*(value.denominator for value in values))
    return Fraction(math.gcd(*(int(value * scale) for value in values)), scale)
