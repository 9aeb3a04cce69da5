"""Clocks by inference: which variables and equations share one, and how ticks relate (Modelica 3.6, section 16.7)."""

import dataclasses
import itertools
from collections.abc import Hashable, Iterator
from fractions import Fraction
from typing import Any

from ..._errors import ModelError
from .._syntax import expressions as e
from .._syntax.flat import FlatModelica, FlatVariable
from .._syntax.visits import parts_of
from .known import KnownValues, variables_in
from .paths import split
from .scope import NotKnown

CONVERSIONS = ("SubSample", "SuperSample", "ShiftSample", "BackSample")
OPERATORS = {"Clock", "EventClock", "Hold", "NoClock", "Previous", "Interval", "FirstTick", *CONVERSIONS}
CLOCKS = ("Clock", "EventClock")


@dataclasses.dataclass(frozen=True)
class Base:
    """What determines the ticks of a clock and of all clocks derived from it.

    Its unit is an `interval`, or a tick of an event clock, at which the `condition` becomes true. The interval of an
    event clock is that before its first tick.
    """

    number: int
    interval: Any
    condition: Any = None


@dataclasses.dataclass(frozen=True)
class Clock:
    """A clock: the interval between its ticks and the time of the first one, in units of its base."""

    base: Base
    interval: Fraction = Fraction(1)
    offset: Fraction = Fraction(0)

    def later(self, factor: Fraction, shift: Fraction) -> "Clock":
        """The clock whose interval is longer by a factor, shifted by a number of intervals."""
        return Clock(self.base, self.interval * factor, self.offset + self.interval * shift)

    def earlier(self, factor: Fraction, shift: Fraction) -> "Clock":
        """The clock from which `later` makes this one."""
        interval = self.interval / factor
        return Clock(self.base, interval, self.offset - interval * shift)


@dataclasses.dataclass(frozen=True)
class _Relation:
    """`to` is later than `of`; the factor is None if it is to be inferred, and then a whole number or its inverse."""

    of: Hashable
    to: Hashable
    factor: Fraction | None
    shift: Fraction
    name: str


class Partitions:
    """Sets of nodes, such as variables, that have one clock each, and relations between them."""

    def __init__(self) -> None:
        self._parent: dict[Hashable, Hashable] = {}
        self._relations: list[_Relation] = []
        self._given: list[tuple[Hashable, Clock]] = []
        self._clocked: set[Hashable] = set()
        self._solvers: dict[Hashable, str] = {}
        self._found: dict[Hashable, Clock] = {}
        self._numbers = itertools.count()

    def fresh(self) -> Hashable:
        return next(self._numbers)

    def root(self, node: Hashable) -> Hashable:
        while (parent := self._parent.get(node, node)) != node:
            self._parent[node] = node = self._parent.get(parent, parent)
        return node

    def join(self, a: Hashable, b: Hashable) -> None:
        self._parent[self.root(a)] = self.root(b)

    def relate(self, of: Hashable, to: Hashable, factor: Fraction | None, shift: Fraction, name: str) -> None:
        self._relations.append(_Relation(of, to, factor, shift, name))

    def give(self, node: Hashable, clock: Clock) -> None:
        self._given.append((node, clock))

    def give_solver(self, node: Hashable, name: str) -> None:
        self._solvers[node] = name

    def mark(self, node: Hashable) -> None:
        """The node has a clock."""
        self._clocked.add(node)

    # Results

    def solve(self) -> None:
        """Infer all clocks. Raises `ModelError` where they contradict each other or are not determined."""
        self._clocked = {self.root(node) for node in self._clocked}
        self._solvers = {self.root(node): name for node, name in self._solvers.items()}
        for node, clock in self._given:
            self._find(node, clock)
        while sum(self._propagated(relation) for relation in self._relations):
            pass
        for relation in self._relations:
            self._check(relation)
        for root in sorted(self._clocked, key=str):
            if root not in self._found:
                raise ModelError(f"{self._example(root)} has no clock. Remedy: state one, such as Clock(0.1).")

    def clock(self, node: Hashable) -> Clock | None:
        """The clock of a node; None if it is not clocked."""
        root = self.root(node)
        return self._found[root] if root in self._clocked else None

    def solver(self, node: Hashable) -> str | None:
        return self._solvers.get(self.root(node))

    def clocks(self) -> Iterator[Clock]:
        return (self._found[root] for root in self._clocked)

    def _find(self, node: Hashable, clock: Clock) -> None:
        root = self.root(node)
        if self._found.setdefault(root, clock) != clock:
            raise ModelError(f"{self._example(root)} has two different clocks.")
        if clock.offset < 0:
            raise ModelError(f"{self._example(root)} would tick before the start: backSample shifts too far.")

    def _propagated(self, relation: _Relation) -> bool:
        factor, shift = relation.factor, relation.shift
        of, to = self._found.get(self.root(relation.of)), self._found.get(self.root(relation.to))
        if factor is None or (of is None) == (to is None):
            return False
        if of is not None:
            self._find(relation.to, of.later(factor, shift))
        elif to is not None:
            self._find(relation.of, to.earlier(factor, shift))
        return True

    def _check(self, relation: _Relation) -> None:
        of, to = self._found.get(self.root(relation.of)), self._found.get(self.root(relation.to))
        if relation.factor is not None:
            if of is not None and to is not None and of.later(relation.factor, relation.shift) != to:
                raise ModelError(f"{self._example(self.root(relation.to))} has two different clocks.")
            return
        if of is None or to is None or of.base != to.base:
            raise ModelError(f"the factor of {relation.name} cannot be inferred. Remedy: state it.")
        ratio = to.interval / of.interval
        if (ratio if relation.name == "subSample" else 1 / ratio).denominator != 1 or to.offset != of.offset:
            raise ModelError(f"the clocks that {relation.name} relates have no whole factor.")

    def _example(self, root: Hashable) -> str:
        names = [node for node in (root, *self._parent) if isinstance(node, str) and self.root(node) == root]
        return min(names, default="a clocked equation", key=len)


class Inference:
    """The clocks of a flat model. Nodes of its partitions are names of variables, and numbers of expressions."""

    def __init__(self, flat: FlatModelica) -> None:
        self.flat = flat
        self.known = KnownValues(flat)
        self.partitions = Partitions()
        self._numbers = itertools.count(1)
        self._inner: dict[int, Hashable] = {}  # nodes of arguments, by the identity of the operator

    # Expressions

    def is_clock(self, x: Any) -> bool:
        """Whether the value of an expression is a clock."""
        match x:
            case e.Ref():
                variable = self._variable(x)
                return variable is not None and variable.type == "Clock"
            case e.If():
                return self.is_clock(x.otherwise)
            case e.Builtin():
                return x.name in CLOCKS or (x.name in CONVERSIONS and self.is_clock(x.args[0]))
        return False

    def is_clocked_sample(self, x: e.Builtin) -> bool:
        return x.name == "Sample" and (len(x.args) == 1 or self.is_clock(x.args[1]))

    def _variable(self, x: e.Ref) -> FlatVariable | None:
        """The variable that a reference names; None for a part with several variables."""
        return self.flat.variables.get(x.name)

    def names(self, x: e.Ref) -> Iterator[str]:
        """The variables that a reference names, without constants and parameters."""
        variable = self._variable(x)
        found = [variable] if variable else variables_in(self.known.tree.find(split(x.name)))
        return (v.name for v in found if v.variability not in ("constant", "parameter"))

    def read(self, x: Any, node: Hashable) -> None:
        """Take up an expression of an equation: its variables have the clock of the node, as far as no operator
        stands between.
        """
        partitions = self.partitions
        if isinstance(x, e.Ref):
            for name in self.names(x):
                partitions.join(name, node)
        if not isinstance(x, e.Builtin) or not (x.name in OPERATORS or self.is_clocked_sample(x)):
            for part in parts_of(x):
                self.read(part, node)
            return
        if x.name == "Sample":
            self.read(x.args[0], partitions.fresh())
            if len(x.args) == 2:
                partitions.join(node, self.clock(x.args[1]))
        elif x.name in ("Hold", "NoClock", *CONVERSIONS):
            inner = self.inner(x)
            partitions.mark(inner)
            self.read(x.args[0], inner)
            if x.name in CONVERSIONS:
                self._relate(x, inner, node)
        else:
            for arg in x.args:
                self.read(arg, node)
        if x.name != "Hold":
            partitions.mark(node)

    def inner(self, x: e.Builtin) -> Hashable:
        """The node of the argument of an operator that joins two clocks."""
        if id(x) not in self._inner:
            self._inner[id(x)] = self.partitions.fresh()
        return self._inner[id(x)]

    # Clocks

    def clock(self, x: Any) -> Hashable:
        """The node of an expression whose value is a clock."""
        if isinstance(x, e.Ref):
            return f"{x.name}[{','.join(str(self.known.value(sub)) for sub in x.subs)}]" if x.subs else x.name
        if isinstance(x, e.If):
            chosen = next((value for condition, value in x.branches if self.known.value(condition)), x.otherwise)
            return self.clock(chosen)
        node = self.partitions.fresh()
        if x.name in CONVERSIONS:
            self._relate(x, self.clock(x.args[0]), node)
        elif x.args:
            self._construct(x, node)
        return node

    def equal_clocks(self, left: Any, right: Any) -> None:
        self.partitions.join(self.clock(left), self.clock(right))

    def _construct(self, x: e.Builtin, node: Hashable) -> None:
        args, partitions = x.args, self.partitions
        first = args[0]
        if self.is_clock(first):
            partitions.join(node, self.clock(first))
            partitions.give_solver(node, str(self.known.value(args[1])))
        elif x.name == "EventClock":
            base = Base(next(self._numbers), args[1] if len(args) == 2 else e.Const(0.0), first)
            partitions.give(node, Clock(base))
        elif any(self._is_known_not_positive(arg) for arg in args):
            raise ModelError("the interval of a clock must be positive.")
        elif len(args) == 2:
            count, resolution = self._whole(args[0]), self._whole(args[1])
            partitions.give(node, Clock(Base(0, e.Const(1)), Fraction(count, resolution)))
        elif (count := self._whole_or_none(first)) is not None:
            partitions.give(node, Clock(Base(0, e.Const(1)), Fraction(count)))
        else:
            partitions.give(node, Clock(Base(next(self._numbers), first)))

    def _is_known_not_positive(self, x: Any) -> bool:
        try:
            return bool(self.known.value(x) <= 0)
        except NotKnown:
            return False

    def _relate(self, x: e.Builtin, of: Hashable, to: Hashable) -> None:
        name, numbers = x.name[0].lower() + x.name[1:], [self._whole(arg) for arg in x.args[1:]]
        factor, shift = Fraction(1), Fraction(0)
        if name in ("subSample", "superSample"):
            factor = None if not numbers or numbers[0] == 0 else Fraction(numbers[0])
            factor = 1 / factor if factor and name == "superSample" else factor
        else:
            shift = Fraction(numbers[0], numbers[1] if len(numbers) == 2 else 1)
        self.partitions.relate(of, to, factor, -shift if name == "backSample" else shift, name)

    def _whole(self, x: Any) -> int:
        found = self._whole_or_none(x)
        if found is None:
            raise ModelError("a factor or counter of a clock must be a whole number that parameters determine.")
        return found

    def _whole_or_none(self, x: Any) -> int | None:
        try:
            found = self.known.value(x)
        except NotKnown:
            return None
        return found if isinstance(found, int) and not isinstance(found, bool) else None
