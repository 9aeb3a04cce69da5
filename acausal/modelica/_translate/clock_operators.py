"""The ticks of clocks, and the operators of clocked equations as variables and changes at ticks."""

import dataclasses
import math
from collections.abc import Callable, Iterable
from fractions import Fraction
from typing import Any

from ..._errors import ModelError
from .._syntax import expressions as e
from .._syntax.flat import FlatEquation, FlatVariable, equality
from .._syntax.visits import mapped
from .clock_inference import CONVERSIONS, Base, Clock, Inference

# Ticks as events of the engine
#
# The clocks of one base have their ticks on a common grid, by whole numbers, so that ticks that coincide do so exactly.
# A discrete variable holds the number of the present tick on this grid; ticks at which no clock is active are left out.

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


# Operators as variables and changes at ticks

_SOLVERS = ("ExplicitEuler", "ImplicitEuler", "ImplicitTrapezoid")


class Operators:
    """Replaces the operators. `variables` are all of the model, `stored` those that events set."""

    def __init__(self, inference: Inference, variables: dict[str, FlatVariable]) -> None:
        self.inference = inference
        self.variables = variables
        self.stored: set[str] = set()
        self._integrated: set[e.Ref] = set()
        self.equations: list[FlatEquation] = []
        self.grids: dict[Base, Grid] = {}
        self._made: dict[tuple[str, str, Clock | None], str] = {}
        for clock in sorted(inference.partitions.clocks(), key=lambda clock: clock.base.number):
            if clock.base not in self.grids:
                self._make_grid(clock.base)

    def _make_grid(self, base: Base) -> None:
        grid = Grid(base, self.inference.partitions.clocks(), f"ticks_of_clock_{base.number}")
        self.grids[base] = grid
        for name, start in grid.starts().items():
            self._store(FlatVariable(name, "Real" if name == grid.origin else "Integer", "discrete"), e.Const(start))

    def of(self, x: Any, clock: Clock | None) -> Any:
        """An expression without operators, in an equation with a clock, or in a continuous one."""
        match x:
            case e.Ref():
                return self._sampled(x, clock) if x == TIME and clock is not None else x
            case e.Builtin():
                found = self._operator(x, clock)
                if found is not None:
                    return found
        return mapped(x, lambda part: self.of(part, clock))

    def _operator(self, x: e.Builtin, clock: Clock | None) -> Any:
        if x.name in ("Hold", "NoClock", *CONVERSIONS):
            own = self.inference.partitions.clock(self.inference.inner(x))
            assert own is not None
            return self._conversion(x.name, self.of(x.args[0], own), own, clock)
        if clock is None:
            return None
        if self.inference.is_clocked_sample(x):
            return self._sampled(self.of(x.args[0], None), clock)
        match x.name:
            case "Previous":
                return self._each(self.of(x.args[0], clock), lambda name: self._previous(name, clock))
            case "FirstTick":
                return self.grids[clock.base].is_first(clock)
            case "Interval":
                return self._interval(clock)
            case "Der":
                return self._derivative(x.args[0], clock)
        return None

    def _conversion(self, name: str, value: Any, own: Clock, clock: Clock | None) -> Any:
        """The value of `hold` and of the operators between clocks."""
        if name in ("Hold", "BackSample", "NoClock"):
            begun = self.grids[own.base].has_begun(own)
            value = e.If(((begun, value),), self._each(value, lambda name: self._previous(name, own)))
        if name in ("Hold", "SuperSample"):
            return value
        assert clock is not None
        if clock.base != own.base:
            return self._sampled(value, clock)
        return self._each(value, lambda name: self._latched(name, clock))

    def _each(self, x: Any, change: Callable[[str], str]) -> Any:
        """An expression whose variables are exchanged."""
        if isinstance(x, e.Ref):
            variable = self.variables.get(x.name)
            if variable is None and x.name != "time":
                if any(self.inference.names(x)):
                    raise ModelError(f"a clocked operator of {x.name}, which is no single variable, is not supported.")
                return x
            if variable is not None and variable.variability in ("constant", "parameter"):
                return x
            return e.Ref(change(x.name), x.subs)
        return mapped(x, lambda part: self._each(part, change))

    # Variables that events set

    def _sampled(self, x: Any, clock: Clock) -> Any:
        """The value of an expression just before the last tick."""
        if isinstance(x, e.Builtin) and x.name == "Der":
            x = self._each(x.args[0], self._rate)
        if isinstance(x, e.Ref):
            return self._each(x, lambda name: self._sample(name, clock))
        return mapped(x, lambda part: self._sampled(part, clock))

    def _sample(self, name: str, clock: Clock) -> str:
        new, is_new = self._new("sampled", name, clock)
        if is_new:
            self._store(new)
            grid = self.grids[clock.base]
            grid.set_at_ticks(clock, new.name, grid.time if name == "time" else e.Ref(name))
        return new.name

    def _rate(self, name: str) -> str:
        """A variable equal to the derivative of a continuous one, which events can read."""
        new, is_new = self._new("der", name, None)
        if is_new:
            self.variables[new.name] = dataclasses.replace(new, start=None, unit=None, fixed=(), binding=None)
            self._equate(e.Ref(new.name), e.Builtin("Der", (e.Ref(name),)))
        return new.name

    def _previous(self, name: str, clock: Clock) -> str:
        new, is_new = self._new("previous", name, clock)
        if is_new:
            self._store(new)
            grid = self.grids[clock.base]
            kept = e.If(((grid.is_first(clock, grid.tick), e.Ref(new.name)),), e.Ref(name))
            grid.set_at_ticks(clock, new.name, kept)
        return new.name

    def _latched(self, name: str, clock: Clock) -> str:
        """A variable that takes over the value of another one while the last tick is one of the clock."""
        new, is_new = self._new("taken", name, clock)
        if is_new:
            grid = self.grids[clock.base]
            before = self._store(dataclasses.replace(new, name=f"{new.name}_before"))
            grid.changes[before] = e.Ref(new.name)
            self.variables[new.name] = discrete(new)
            self._equate(e.Ref(new.name), e.If(((grid.is_active(clock), e.Ref(name)),), e.Ref(before)))
        return new.name

    def _interval(self, clock: Clock) -> Any:
        grid = self.grids[clock.base]
        if clock.base.condition is None:
            return grid.interval(clock)
        last, is_new = self._new("last", "time", clock)
        interval, _ = self._new("interval", "time", clock)
        if is_new:
            self._store(last)
            self._store(interval)
            since = binary("Sub", TIME, e.Ref(last.name))
            first = grid.is_first(clock, grid.tick)
            grid.set_at_ticks(clock, interval.name, e.If(((first, clock.base.interval),), since))
            grid.set_at_ticks(clock, last.name, TIME)
        return e.Ref(interval.name)

    def _derivative(self, x: Any, clock: Clock) -> Any:
        """The derivative of a clocked variable, which a method of integration relates to it (section 16.8.2)."""
        name = x.name if isinstance(x, e.Ref) else ""
        solver = self.inference.partitions.solver(name)
        if name not in self.variables or solver not in _SOLVERS:
            raise ModelError(
                f"der({name}) is clocked and needs a clock with a solverMethod among {', '.join(_SOLVERS)}; "
                f"it has {solver or 'none'}."
            )
        new, is_new = self._new("der", name, clock)
        if is_new:
            self.variables[new.name] = discrete(dataclasses.replace(new, start=None, unit=None))
        rate = e.Ref(new.name, x.subs)
        if x not in self._integrated:
            self._integrated.add(x)
            before = e.Ref(self._previous(new.name, clock), x.subs)
            slope = {"ExplicitEuler": before, "ImplicitEuler": rate}.get(
                solver, binary("Mul", e.Const(0.5), binary("Add", rate, before))
            )
            old, first = e.Ref(self._previous(name, clock), x.subs), self.grids[clock.base].is_first(clock)
            stepped = binary("Add", old, binary("Mul", self._interval(clock), slope))
            self._equate(x, e.If(((first, old),), stepped))
        return rate

    # New variables

    def _new(self, word: str, of: str, clock: Clock | None) -> tuple[FlatVariable, bool]:
        """A variable that is named after another one, and whether it is new."""
        key, is_new = (word, of, clock), (word, of, clock) not in self._made
        if is_new:
            head, dot, last = of.rpartition(".")
            same = sum(other[:2] == key[:2] for other in self._made)
            self._made[key] = f"{head}{dot}{word}_{last}" + (f"_{same + 1}" if same else "")
        variable = FlatVariable("time", "Real", "discrete") if of == "time" else self.variables[of]
        return dataclasses.replace(variable, name=self._made[key]), is_new

    def _store(self, variable: FlatVariable, start: Any = None) -> str:
        start = variable.start if start is None else start
        self.stored.add(variable.name)
        self.variables[variable.name] = dataclasses.replace(discrete(variable), start=start, fixed=(True,))
        return variable.name

    def _equate(self, ref: e.Ref, value: Any) -> None:
        self.equations.append(equality(ref, value, "clock", ref.name.rpartition(".")[0]))


def discrete(variable: FlatVariable) -> FlatVariable:
    """A variable that changes at events only, whose start value is only that of `previous`."""
    return dataclasses.replace(variable, variability="discrete", binding=None, fixed=())
