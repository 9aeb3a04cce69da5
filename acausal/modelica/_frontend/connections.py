"""Connections (Modelica 3.6, section 9.2): the sets that `connect` makes, and their equations."""

import dataclasses
import functools as ft
import itertools
from collections.abc import Callable, Hashable, Iterator, Sequence
from typing import TYPE_CHECKING, Generic, TypeAlias, TypeVar

from .._syntax import expressions as e
from .._syntax.flat import FlatEquation, SourcePlace, equality
from .._syntax.visits import nodes
from . import references
from . import tree as t
from .classes import ComponentElement, Instance
from .expandable import Expansion
from .expressions import Expressions
from .modifiers import Index
from .source import Spot
from .typed import Type, accepts, indices, same_dims, written_dims

if TYPE_CHECKING:
    from .structure import Context


@dataclasses.dataclass(frozen=True, slots=True)
class Connector:
    """A connector at one place. `is_outside`: it belongs to the class with the connection, not to a component there."""

    component: ComponentElement
    index: Index
    is_outside: bool

    @property
    def instance(self) -> Instance:
        return self.component.member(self.index)

    @property
    def path(self) -> str:
        return self.instance.path


@dataclasses.dataclass(frozen=True, slots=True)
class ConnectorEnd:
    """A variable in a connector: with a subscript if only an element of it is connected."""

    name: str
    subs: Index
    is_outside: bool
    component: ComponentElement | None = dataclasses.field(default=None, compare=False)

    @property
    def ref(self) -> e.Ref:
        return e.Ref(self.name, tuple(e.Const(i) for i in self.subs))

    @property
    def holder(self) -> str:
        """The connector, or the component of a connector that is a variable itself."""
        return self.name.rpartition(".")[0]


@dataclasses.dataclass(frozen=True, slots=True)
class Pair:
    """A connection of two variables, of the same size."""

    left: ConnectorEnd
    right: ConnectorEnd
    dims: Index
    kind: str  # "", "flow" or "stream"
    spot: Spot


_Item = TypeVar("_Item", bound=Hashable)
Flow: TypeAlias = tuple[str, Index, SourcePlace, tuple[bool, ...]]  # name, size, place, sides (`is_outside`)


class Sets(Generic[_Item]):
    """Sets of connected things, in the order in which they were connected."""

    def __init__(self) -> None:
        self._parent: dict[_Item, _Item] = {}

    def find(self, x: _Item) -> _Item:
        parent = self._parent.setdefault(x, x)
        while parent is not x:
            self._parent[x] = self._parent[parent]
            x, parent = parent, self._parent[parent]
        return x

    def join(self, a: _Item, b: _Item) -> bool:
        """Joins two sets. Returns whether they were different."""
        a, b = self.find(a), self.find(b)
        self._parent[b] = a
        return a is not b

    def all(self) -> list[list[_Item]]:
        found: dict[_Item, list[_Item]] = {}
        for x in self._parent:
            found.setdefault(self.find(x), []).append(x)
        return list(found.values())

    def __contains__(self, x: _Item) -> bool:
        return x in self._parent


class Connections:
    """The connections of a model."""

    def __init__(self, context: "Context") -> None:
        self.context = context
        self.pairs: list[Pair] = []
        self.connectors: list[tuple[Connector, Connector, Spot]] = []
        self.operators: list[tuple[str, t.Call, Expressions]] = []
        self.counts: dict[str, int] = {}
        self.equal: list[tuple[ConnectorEnd, ConnectorEnd]] = []  # parameters that must be equal
        self.expansion = Expansion(context, self)
        self._expandable: list[tuple[Connector, Connector, Spot]] = []

    # The connections in the text

    def visit(self, here: Expressions, clauses: Sequence[t.Clause]) -> None:
        """Adds the connections of the equations of a class instance."""
        for clause in clauses:
            self._visit(here, clause)

    def _visit(self, here: Expressions, x: t.Clause) -> None:
        from .equations import has_connections

        match x:
            case t.Connect():
                if not here.scope.is_removed(x):
                    self._connect(here, x)
            case t.CallEquation() if x.call.function.names[0] == "Connections":
                self.operators.append((x.call.function.names[-1], x.call, here))
            case t.ForClause() if has_connections(x):
                for within in here.unrolled(x.iterators, x.body):
                    self.visit(within, x.body)
            case t.IfClause() if has_connections(x) and not _reads_graph(x):
                _, chosen = here.choice(x)
                if chosen is None:
                    raise here.error(
                        x.at, "the condition of an if-equation with connections must be a parameter with a value."
                    )
                self.visit(here, chosen)

    def _connect(self, here: Expressions, x: t.Connect) -> None:
        self.expansion.declare(here, x.left, x.right)
        self.expansion.declare(here, x.right, x.left)
        left, right = self.ends(here, x.left), self.ends(here, x.right)
        if left is None or right is None:
            return  # a component that is absent
        spot = Spot(here.scope.source, x.at)
        if not same_dims(left[1], right[1]):
            raise spot.error(
                f"the connectors have different sizes: {written_dims(left[1])} and {written_dims(right[1])}."
            )
        pairs = list(zip(left[0], right[0], strict=True))
        first, second = self._whole(left[0]), self._whole(right[0])
        if first is not None and second is not None:
            self._join_variables(first, second, spot)
            return
        for a, b in pairs:
            if isinstance(a, Connector) and isinstance(b, Connector):
                self._join(a, b, spot)
            elif isinstance(a, Connector) or isinstance(b, Connector):
                raise spot.error("the connectors have different types.")
            else:
                self._join_variables(a, b, spot)

    def _whole(self, ends: Sequence[Connector | ConnectorEnd]) -> ConnectorEnd | None:
        """The array whose elements are all connected, in their order."""
        if not ends or not isinstance(end := ends[0], ConnectorEnd):
            return None
        sizes = [n or 0 for n in self.context.sizes(self.component(end))]
        is_whole = sizes and list(ends) == [dataclasses.replace(end, subs=index) for index in indices(sizes)]
        return dataclasses.replace(end, subs=()) if is_whole else None

    def ends(self, here: Expressions, x: t.Expression) -> tuple[list[Connector] | list[ConnectorEnd], Index] | None:
        """The connectors that one side of a connection names, and their number. None if they are absent."""
        if not isinstance(x, t.Reference):
            raise here.error(x.at, "`connect` needs connectors.")
        found = references.find(here, x)
        if not isinstance(found, references.Chain):
            raise here.error(x.at, f"{x} is no connector.")
        self._check(here, x, found)
        # The inner connector of an outer one is outside of the class that declares it, like the outer one itself.
        is_outside = found.components[0].prototype.is_connector
        members: list[tuple[ComponentElement, Index]] = []
        dims: list[int] = []
        holders = [here.scope.whole]
        for i, (component, part) in enumerate(zip(found.components, found.parts, strict=True)):
            here_members: list[tuple[ComponentElement, Index]] = []
            sizes_found: list[int] = []
            for holder in holders:
                own = component if i == 0 else holder.elements[component.name]
                assert isinstance(own, ComponentElement)
                own = self.context.inner(own)
                if not self.context.is_present(own):
                    return None
                sizes_found = []
                here_members += [(own, index) for index in self._members(here, own, part, sizes_found)]
            dims += sizes_found
            members = here_members
            holders = [component.member(index) for component, index in members]
        if _is_variable(found.last):
            return [ConnectorEnd(c.path, index, is_outside, c) for c, index in members], tuple(dims)
        return [Connector(c, index, is_outside) for c, index in members], tuple(dims)

    def _check(self, here: Expressions, x: t.Reference, found: references.Chain) -> None:
        around = [one.prototype.kind for one in found.components[:-1]]
        if not found.last.prototype.is_connector and "expandable connector" not in around:
            raise here.error(x.at, f"{x} is a {found.last.prototype.kind}, not a connector.")
        if any(not kind.endswith("connector") for kind in around[1:]):
            raise here.error(
                x.at, f"{x} is inside of a part of {found.components[0].name}, and cannot be connected here."
            )

    def _members(
        self, here: Expressions, component: ComponentElement, part: t.Part, dims: list[int]
    ) -> Iterator[Index]:
        """The indices that the subscripts of a part choose."""
        sizes = [n or 0 for n in self.context.sizes(component)]
        subs, rest = here.subscripts(part, tuple(sizes), e.Ref(component.path))
        dims += [n or 0 for n in rest]
        chosen = [one for one in here.members(subs, sizes) if one is not None]
        if len(chosen) < len(sizes):
            raise here.error(part.at, "a subscript in a connection must be known.")
        return itertools.product(*chosen)

    # Pairs of variables

    def complete(self) -> None:
        """Adds the connections of expandable connectors, which then have the same elements."""
        self.expansion.complete([(a, b) for a, b, _ in self._expandable])
        for a, b, spot in self._expandable:
            self._join_all(a, b, spot)

    def _join(self, a: Connector, b: Connector, spot: Spot) -> None:
        kinds = {one.instance.is_expandable for one in (a, b)}
        if len(kinds) > 1:
            raise spot.error(f"only one of {a.path} and {b.path} is expandable.")
        if kinds == {True}:
            self._expandable.append((a, b, spot))
        else:
            self._join_all(a, b, spot)

    def _join_all(self, a: Connector, b: Connector, spot: Spot) -> None:
        self.connectors.append((a, b, spot))
        for one in (a, b):
            self.counts[one.path] = self.counts.get(one.path, 0) + 1
        own = {one.name: one for one in a.instance.components()}
        other = {one.name: one for one in b.instance.components()}
        if own.keys() != other.keys():
            differing = sorted(own.keys() ^ other.keys())
            raise spot.error(f"the connectors {a.path} and {b.path} do not match: only one has {differing[0]}.")
        for name, left in own.items():
            right = other[name]
            if not self.context.is_present(left) or not self.context.is_present(right):
                continue
            if left.connection != right.connection:
                raise spot.error(
                    f"{left.path} and {right.path} do not match: only one is {left.connection or right.connection}."
                )
            sizes, others = self.context.sizes(left), self.context.sizes(right)
            if not same_dims(sizes, others):
                raise spot.error(f"{left.path} and {right.path} have different sizes.")
            if _is_variable(left) and _is_variable(right):
                end = ConnectorEnd(left.path, (), a.is_outside, left)
                self._join_variables(end, ConnectorEnd(right.path, (), b.is_outside, right), spot)
                continue
            if _is_variable(left) or _is_variable(right):
                raise spot.error(f"{left.path} and {right.path} have different types.")
            for index in indices(sizes):
                self._join_all(Connector(left, index, a.is_outside), Connector(right, index, b.is_outside), spot)

    def _join_variables(self, left: ConnectorEnd, right: ConnectorEnd, spot: Spot) -> None:
        own, other = self.component(left), self.component(right)
        kind, wanted = own.value_type, other.value_type
        if not _fit(kind, wanted):
            raise spot.error(f"{left.name} is of type {kind}, and {right.name} of type {wanted}.")
        if own.connection != other.connection:
            raise spot.error(
                f"{left.name} and {right.name} do not match: only one is {own.connection or other.connection}."
            )
        if bool(own.causality) != bool(other.causality) and not self._are_expandable(own, other):
            first, second = (left, right) if own.causality else (right, left)
            raise spot.error(
                f"{first.name} is an {own.causality or other.causality}, but {second.name} is neither input nor output."
            )
        fixed = [one.variability if one.variability in ("constant", "parameter") else "" for one in (own, other)]
        if fixed[0] != fixed[1]:
            raise spot.error(f"{left.name} and {right.name} do not match: only one is a {fixed[0] or fixed[1]}.")
        if fixed[0]:
            self.equal.append((left, right))
        dims = [n or 0 for n in self.context.sizes(own)][len(left.subs) :]
        others = [n or 0 for n in self.context.sizes(other)][len(right.subs) :]
        if dims != others:
            raise spot.error(f"{left.name} and {right.name} have different sizes.")
        for one in (own, other):
            self.context.register(one)
            self.counts[one.path] = self.counts.get(one.path, 0) + 1
        self.pairs.append(Pair(left, right, tuple(dims), own.connection, spot))

    def _are_expandable(self, *components: ComponentElement) -> bool:
        """Whether one belongs to an expandable connector, whose variables get their direction from others."""
        around = [one.parent for one in components]
        return any(one is not None and one.prototype.is_expandable for one in around)

    def check_direction(self, members: Sequence[ConnectorEnd], spot: Spot) -> None:
        """Raises `TextError` for connected signals with several sources (section 9.3)."""
        sources: list[str] = []
        for end in members:
            component = self.component(end)
            if self._are_expandable(component):
                return
            is_hidden = end.is_outside and component.is_protected
            if not is_hidden and component.causality == ("input" if end.is_outside else "output"):
                sources.append(end.name)
        if len(sources) > 1:
            raise spot.error(f"both {sources[0]} and {sources[1]} give a value to signals that are connected.")

    def asserts(self) -> list[e.Assert]:
        """The assertions that connected parameters are equal (section 9.2)."""
        return [
            e.Assert(e.Binary("Eq", left.ref, right.ref), e.Const(f"{left.name} and {right.name} differ."), False)
            for left, right in self.equal
            if left.ref != right.ref and not self.context.sizes(self.component(left))[len(left.subs) :]
        ]

    def component(self, end: ConnectorEnd) -> ComponentElement:
        assert end.component is not None
        return end.component

    def split(self, is_broken: Callable[[Pair], bool] = lambda pair: False) -> list[Pair]:
        """The pairs, except broken ones. An array of which an element is connected alone is split into elements."""
        single = {end.name for pair in self.pairs for end in (pair.left, pair.right) if end.subs}
        changed = True
        while changed:
            changed = False
            for pair in self.pairs:
                names = {pair.left.name, pair.right.name}
                if pair.dims and names & single and not names <= single:
                    single |= names
                    changed = True
        found: list[Pair] = []
        for pair in self.pairs:
            if is_broken(pair):
                continue
            if pair.dims and (pair.left.name in single or pair.kind == "stream"):
                for index in indices(pair.dims):
                    left = dataclasses.replace(pair.left, subs=(*pair.left.subs, *index))
                    right = dataclasses.replace(pair.right, subs=(*pair.right.subs, *index))
                    found.append(dataclasses.replace(pair, left=left, right=right, dims=()))
            elif 0 not in pair.dims:
                found.append(pair)
        return found


def equations(
    connections: Connections,
    flows: Sequence[Flow],
    is_broken: Callable[[Pair], bool],
) -> Iterator[FlatEquation]:
    """The equations of the connections. `flows` are all flow variables of connectors."""
    potentials, sums = Sets[ConnectorEnd](), Sets[ConnectorEnd]()
    pairs: dict[ConnectorEnd, Pair] = {}
    for pair in connections.split(is_broken):
        pairs.setdefault(pair.left, pair)
        pairs.setdefault(pair.right, pair)
        if pair.kind == "flow":
            sums.join(pair.left, pair.right)
        elif pair.kind == "":
            potentials.join(pair.left, pair.right)
    for members in potentials.all():
        first = members[0]
        connections.check_direction(members, pairs[members[-1]].spot)
        for other in members[1:]:
            if other.ref != first.ref and connections.component(first).variability not in ("constant", "parameter"):
                yield equality(first.ref, other.ref, "connection", other.holder, pairs[other].spot.place)
    for members in sums.all():
        total = added([e.Unary("Minus", one.ref) if one.is_outside else one.ref for one in members])
        yield FlatEquation(total, members[0].holder, "flows", pairs[members[0]].spot.place)
    for name, dims, place, sides in flows:
        for is_outside in sides:
            yield from _open(sums, name, dims, place, is_outside=is_outside)


def added(terms: Sequence[e.Expression]) -> e.Expression:
    return ft.reduce(lambda a, b: e.Binary("Add", a, b), terms)


def _open(
    sums: Sets[ConnectorEnd], name: str, dims: Index, place: SourcePlace, *, is_outside: bool
) -> Iterator[FlatEquation]:
    """The equations of a flow variable as far as nothing is connected to it."""
    ends = [ConnectorEnd(name, index, is_outside) for index in indices(dims)]
    if dims and ConnectorEnd(name, (), is_outside) in sums:
        return
    open_ones = [one for one in ends if one not in sums]
    if len(open_ones) == len(ends) and dims:
        yield FlatEquation(e.Ref(name), "", "open flow", place)
    else:
        for one in open_ones:
            yield FlatEquation(one.ref, "", "open flow", place)


def _fit(a: Type, b: Type) -> bool:
    return a.name == b.name and accepts(a, b)


def _is_variable(component: ComponentElement) -> bool:
    kind = component.value_type
    return kind.is_plain or kind.name in ("Clock", "object")


def _reads_graph(x: t.IfClause) -> bool:
    conditions = tuple(condition for condition, _ in x.branches)
    calls = (one for one in nodes(conditions) if isinstance(one, t.Call))
    return any(call.function.names[-1] in ("isRoot", "rooted", "cardinality") for call in calls)
