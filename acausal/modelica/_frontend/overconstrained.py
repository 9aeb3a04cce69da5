"""Overconstrained connections (Modelica 3.6, section 9.4): the graph whose loops are broken."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from .._syntax import expressions as e
from .._syntax.flat import FlatEquation, equality
from . import references
from . import tree as t
from .calls import call_values, of_class
from .classes import ClassElement
from .connections import Connections, Connector, Pair, Sets
from .expressions import Expressions
from .source import Spot
from .typed import Dims, Typed

if TYPE_CHECKING:
    from .structure import Context

_ROOT = "<root>"


class Graph:
    """The spanning trees of the overconstrained records of a model, each with one root."""

    def __init__(self, context: "Context", connections: Connections) -> None:
        self._context = context
        self._trees = Sets[str]()
        self._edges: dict[str, list[str]] = {}
        self._branches: list[tuple[str, str]] = []
        self.roots: list[str] = []
        self.broken: list[tuple[Connector, Connector, Spot]] = []
        potential: list[tuple[int, str]] = []
        for name, call, here in connections.operators:
            self._operator(name, call, here, potential)
        for a, b, spot in (*connections.connectors, *self._types(connections)):
            if "equalityConstraint" in a.instance.elements:
                if self._trees.join(a.path, b.path):
                    self._edge(a.path, b.path)
                else:
                    self.broken.append((a, b, spot))
        for _, path in sorted(potential, key=lambda one: one[0]):
            if self._trees.join(_ROOT, path):
                self.roots.append(path)
        for path in [path for tree in self._trees.all() for path in tree]:
            if path != _ROOT and self._trees.join(_ROOT, path):
                self.roots.append(path)
        self._depths = self._measured()

    def _types(self, connections: Connections) -> Iterator[tuple[Connector, Connector, Spot]]:
        """The connected variables whose types are overconstrained, as angles of rotating frames are."""
        for pair in connections.pairs:
            a, b = self._context.find(pair.left.name), self._context.find(pair.right.name)
            if a is not None and b is not None:
                yield Connector(a, (), pair.left.is_outside), Connector(b, (), pair.right.is_outside), pair.spot

    def _operator(self, name: str, call: t.Call, here: Expressions, potential: list[tuple[int, str]]) -> None:
        paths = [self._path(here, arg) for arg in call.args[: 2 if name == "branch" else 1]]
        if None in paths:
            return
        first, *rest = [path for path in paths if path is not None]
        if name == "branch":
            if not self._trees.join(first, rest[0]):
                raise here.error(call.at, f"`Connections.branch` closes a loop from {first} to {rest[0]}.")
            self._edge(first, rest[0])
            self._branches.append((first, rest[0]))
        elif name == "root":
            if not self._trees.join(_ROOT, first):
                raise here.error(call.at, f"{first} is a root beside another one of the same tree.")
            self.roots.append(first)
        elif name == "potentialRoot":
            priority = call.args[1] if len(call.args) > 1 else dict(call.named).get("priority")
            potential.append((0 if priority is None else int(here.known(priority, "the priority")), first))
            self._trees.find(first)
        else:
            raise here.error(call.at, f"`Connections.{name}` is not supported.")

    def _path(self, here: Expressions, arg: t.Expression) -> str | None:
        found = here.single(arg)
        named = references.find(here, arg) if isinstance(arg, t.Reference) else None
        if not isinstance(named, references.Chain) or "equalityConstraint" not in named.last.prototype.elements:
            raise here.error(arg.at, "this argument must be a record or type with the function equalityConstraint.")
        if not isinstance(found.x, e.Ref) or found.x.subs or len(named.components) < 2:
            raise here.error(arg.at, "this argument must be a record or a type of a connector.")
        return found.x.name

    def _edge(self, a: str, b: str) -> None:
        self._edges.setdefault(a, []).append(b)
        self._edges.setdefault(b, []).append(a)

    def _measured(self) -> dict[str, int]:
        """The distances from the roots."""
        found = dict.fromkeys(self.roots, 0)
        todo = list(self.roots)
        for here in todo:
            for other in self._edges.get(here, ()):
                if other not in found:
                    found[other] = found[here] + 1
                    todo.append(other)
        return found

    def is_root(self, path: str) -> bool:
        return path in self.roots

    def is_rooted(self, path: str) -> bool:
        """Whether a record is nearer to the root than the one to which a branch leads from it."""
        for a, b in self._branches:
            if path in (a, b):
                other = b if path == a else a
                return self._depths.get(path, 0) < self._depths.get(other, 0)
        return path in self.roots

    def is_broken(self, pair: Pair) -> bool:
        """Whether a pair of variables belongs to a connection that is broken."""
        return any(_has(a.path, pair.left.name) and _has(b.path, pair.right.name) for a, b, _ in self.broken)

    def equations(self) -> Iterator[FlatEquation]:
        """The equations in place of those of broken connections."""
        for a, b, spot in self.broken:
            element = of_class(a.instance).elements["equalityConstraint"]
            if not isinstance(element, ClassElement):
                continue
            root = self._context.top.root
            assert root is not None
            here = Expressions(self._context, root)
            sides = [Typed(e.Ref(one.path), one.instance.value_type, self._sizes(one)) for one in (a, b)]
            for one in (a, b):
                self._context.register(one.component)
            found = call_values(here, element.instance, sides)
            if found is None:
                raise a.component.error("the function equalityConstraint has other inputs than two of its record.")
            size = found.dims[0] if found.dims else None
            if size == 0:
                continue
            zero: e.Expression = e.Const(0.0) if size is None else e.Builtin("Zeros", (e.Const(size),))
            yield equality(zero, found.x, "connection", place=spot.place)

    def _sizes(self, one: Connector) -> Dims:
        return self._context.sizes(one.component)[len(one.index) :]


def _has(path: str, name: str) -> bool:
    return name == path or name.startswith((f"{path}.", f"{path}["))
