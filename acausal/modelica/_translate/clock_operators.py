"""The operators of clocked equations, as variables and changes at ticks."""

import dataclasses
from collections.abc import Callable
from typing import Any

from ..._errors import ModelError
from .._syntax import expressions as e
from .._syntax.flat import FlatEquation, FlatVariable
from .._syntax.visits import mapped
from .clock_inference import CONVERSIONS, Base, Clock, Inference
from .clock_ticks import TIME, Grid, binary

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
        self.equations.append(FlatEquation(e.Binary("Sub", ref, value), ref.name.rpartition(".")[0], "clock", None))


def discrete(variable: FlatVariable) -> FlatVariable:
    """A variable that changes at events only, whose start value is only that of `previous`."""
    return dataclasses.replace(variable, variability="discrete", binding=None, fixed=())
