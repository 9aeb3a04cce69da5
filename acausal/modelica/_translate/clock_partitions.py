"""Clocks by inference: which variables share one, and how their ticks relate (Modelica 3.6, section 16.7)."""

import dataclasses
import itertools
from collections.abc import Hashable, Iterator
from fractions import Fraction
from typing import Any

from ..._errors import ModelError


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
