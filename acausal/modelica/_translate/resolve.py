"""Resolution of names: from expressions of the flat model to terms over slots."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np

from ..._errors import ModelError
from .._syntax import expressions as e
from .._syntax.flat import FlatVariable
from .evaluate import NotKnown, is_supported
from .known import KnownValues
from .leaves import ModelLeaf
from .paths import PathTree, split
from .statement_terms import resolved_body
from .terms import Opaque, RecordOf, SlotValue
from .values import Value, is_known


class Slots:
    """The leaves that a term reads, in the order of their slots."""

    def __init__(self) -> None:
        self.leaves: list[ModelLeaf] = []
        self._places: dict[str, int] = {}

    def slot(self, leaf: ModelLeaf) -> SlotValue:
        if leaf.path not in self._places:
            self._places[leaf.path] = len(self.leaves)
            self.leaves.append(leaf)
        return SlotValue(self._places[leaf.path], leaf.kind, leaf.is_discrete or leaf.role == "param")


@dataclasses.dataclass
class Resolver:
    """Resolves names to leaves and known values.

    `leaves` are those of the model by Modelica name. `previous` makes the leaf that holds `pre` of another one.
    """

    known: KnownValues
    leaves: Mapping[str, ModelLeaf]
    previous: "Previous"

    def term(self, x: Any, slots: Slots, local: frozenset[str] = frozenset()) -> Any:
        """The term of an expression. Names in `local` stay as they are."""
        return _Resolution(self, slots, local).term(x)

    def body(self, body: e.Body, slots: Slots, local: frozenset[str]) -> e.Body:
        """Statements with resolved expressions, whose targets are names in `local`."""
        return resolved_body(body, _Resolution(self, slots, local).term)


class Previous:
    """The leaves that hold the values of `pre`. `leaves` are those of the model, whose names are taken."""

    def __init__(self, leaves: Mapping[str, ModelLeaf]) -> None:
        self.of: dict[str, ModelLeaf] = {}
        self._leaves = leaves

    def leaf(self, leaf: ModelLeaf) -> ModelLeaf:
        """The discrete leaf for `pre` of a leaf."""
        if leaf.path not in self.of:
            head, dot, last = leaf.path.rpartition(".")
            start = leaf.guess if leaf.value is None else leaf.value
            start = jnp.broadcast_to(jnp.asarray(start, float), leaf.dims)
            path = f"{head}{dot}pre_{last}"
            while path in self._leaves:
                path += "_"
            self.of[leaf.path] = dataclasses.replace(
                leaf,
                path=path,
                role="discrete",
                is_discrete=True,
                value=start,
                is_followed=False,
                variable=None,
            )
        return self.of[leaf.path]


@dataclasses.dataclass
class _Resolution:
    model: Resolver
    slots: Slots
    local: frozenset[str]

    def term(self, x: Any) -> Any:
        match x:
            case e.Ref():
                return self._ref(x)
            case e.If():
                return self._if(x)
            case e.Builtin():
                return self._builtin(x)
            case e.FieldOf():
                return field(self.term(x.base), x.name)
            case e.Subscript():
                return element(self.term(x.base), self._subs(x.subs))
            case e.Comprehension():
                inner = _Resolution(self.model, self.slots, self.local | {name for name, _ in x.indices})
                return e.Comprehension(inner.term(x.body), tuple((name, self.term(over)) for name, over in x.indices))
            case e.Const() | e.Colon():
                return x
            case e.Text():
                return e.Text(self.term(x.arg))
        return with_parts(x, self.term)

    def _subs(self, subs: Sequence[Any]) -> tuple[Any, ...]:
        ending = _Resolution(self.model, self.slots, self.local | {"end"})
        return tuple(ending.term(sub) for sub in subs)

    def _ref(self, x: e.Ref) -> Any:
        head = x.name.partition(".")[0]
        if x.name in self.local or head in self.local:
            return e.Ref(x.name, self._subs(x.subs))
        found = self._named(x.name)
        return element(found, self._subs(x.subs)) if x.subs else found

    def _named(self, name: str) -> Any:
        leaf = self.model.leaves.get(name)
        if leaf is not None:
            return self.slots.slot(leaf)
        if name in self.model.known.flat.enumerations:
            return e.Const(self.model.known.flat.enumerations[name])
        variable = self.model.known.flat.variables.get(name)
        if variable is not None:
            if 0 in variable.dims:
                return constant(np.zeros(variable.dims), name)
            return constant(self.model.known.value_of(variable), name)
        base, bracket, index = name.rpartition("[")
        if bracket and index.endswith("]") and base in self.model.leaves:
            return element(self._named(base), tuple(e.Const(int(i)) for i in index[:-1].split(",")))
        return self._whole(self.model.known.tree.find(split(name)), name)

    def _whole(self, branch: PathTree[FlatVariable] | list | None, name: str) -> Any:
        if branch is None:
            raise ModelError(f"the name {name} is unknown.")
        if isinstance(branch, list):
            return e.ArrayOf(tuple(self._whole(item, name) for item in branch), "array")
        if branch.item is not None:
            return self._named(branch.item.name)
        if branch.parts:
            return RecordOf(tuple((part, self._whole(inner, name)) for part, inner in branch.parts.items()))
        if not branch.members:
            raise ModelError(f"the name {name} is unknown.")
        return _nested([self._whole(inner, name) for inner in branch.members.values()], list(branch.members))

    def _if(self, x: e.If) -> Any:
        branches = []
        for condition, value in x.branches:
            truth = self._truth(condition)
            if truth is None:
                branches.append((self.term(condition), self.term(value)))
            elif truth:
                otherwise = self.term(value)
                return e.If(tuple(branches), otherwise) if branches else otherwise
        otherwise = self.term(x.otherwise)
        return e.If(tuple(branches), otherwise) if branches else otherwise

    def _truth(self, condition: Any) -> Value | None:
        """The truth of a condition that is known."""
        try:
            found = self.model.known.value(condition)
        except (NotKnown, ModelError):  # an error occurs again where the value is needed
            return None
        return bool(found) if is_known(found) else None

    def _builtin(self, x: e.Builtin) -> Any:
        match x.name:
            case "Pre":
                return self._pre(x.args[0])
            case "Edge":
                return e.Binary("And", self.term(x.args[0]), e.Unary("Not", self._pre(x.args[0])))
            case "Change":
                return e.Binary("Neq", self.term(x.args[0]), self._pre(x.args[0]))
            case "Initial":
                return self._named("initial_")
            case "Size":
                return self._size(x)
        if not is_supported(x.name):
            raise ModelError(f"the function {x.name.lower()} is not supported.")
        return e.Builtin(x.name, tuple(self.term(arg) for arg in x.args))

    def _pre(self, x: Any) -> Any:
        if isinstance(x, e.ArrayOf):
            return e.ArrayOf(tuple(self._pre(item) for item in x.elements), x.kind)
        if isinstance(x, e.Ref) and x.name in self.local and x.name in self.model.leaves:
            x = e.Ref(x.name, x.subs)  # an output of an algorithm: its value before
            found = self._named(x.name)
            return self._previous(element(found, self._subs(x.subs)) if x.subs else found)
        return self._previous(self.term(x))

    def _previous(self, found: Any) -> Any:
        match found:
            case SlotValue():
                leaf = self.slots.leaves[found.number]
                # In a when-clause, `pre` of a continuous variable is its value: states change after the clause.
                is_same = leaf.role in ("param", "time") or (leaf.role == "var" and not leaf.is_discrete)
                return found if is_same else self.slots.slot(self.model.previous.leaf(leaf))
            case e.Subscript():
                return e.Subscript(self._previous(found.base), found.subs)
            case e.ArrayOf():
                return e.ArrayOf(tuple(self._previous(item) for item in found.elements), found.kind)
            case RecordOf():
                return RecordOf(tuple((name, self._previous(item)) for name, item in found.fields))
            case e.Const() | Opaque():
                return found
        raise ModelError("`pre` needs a variable.")

    def _size(self, x: e.Builtin) -> Any:
        base = self.term(x.args[0])
        if isinstance(base, SlotValue):
            dims = self.slots.leaves[base.number].dims
            if len(x.args) == 1:
                return constant(np.array(dims, int), str(dims))
            return e.Const(dims[int(self.model.known.value(x.args[1])) - 1])
        return e.Builtin("Size", (base, *(self.term(arg) for arg in x.args[1:])))


def constant(value: Value, key: str) -> Any:
    """A known value as a term."""
    if isinstance(value, bool | int | float | str):
        return e.Const(value)
    if isinstance(value, np.ndarray):
        return Opaque(f"{value.dtype}{value.tolist()}", value)
    if isinstance(value, dict):
        return RecordOf(tuple((name, constant(item, f"{key}.{name}")) for name, item in value.items()))
    return Opaque(f"{key} {value!r}", value)


def field(term: Any, name: str) -> Any:
    """A field of a record, or of each record of an array."""
    if isinstance(term, RecordOf):
        for own, value in term.fields:
            if own == name:
                return value
        raise ModelError(f"the record has no field {name}.")
    if isinstance(term, e.ArrayOf) and term.kind == "array":
        return e.ArrayOf(tuple(field(item, name) for item in term.elements), "array")
    if isinstance(term, e.Subscript):
        return e.Subscript(field(term.base, name), term.subs)
    return e.FieldOf(term, name)


def element(term: Any, subs: tuple[Any, ...]) -> Any:
    """Elements of an array, chosen at once where array and index are written out."""
    if isinstance(term, e.ArrayOf) and term.kind == "array" and subs and isinstance(subs[0], e.Const):
        found = term.elements[int(subs[0].value) - 1]
        return element(found, subs[1:]) if len(subs) > 1 else found
    if isinstance(term, RecordOf):
        return RecordOf(tuple((name, element(item, subs)) for name, item in term.fields))
    return e.Subscript(term, subs)


def _nested(items: list[Any], indices: list[tuple[int, ...]]) -> Any:
    if len(indices[0]) == 1:
        return e.ArrayOf(tuple(items), "array")
    rows: dict[int, tuple[list[Any], list[tuple[int, ...]]]] = {}
    for item, (first, *rest) in zip(items, indices, strict=True):
        own = rows.setdefault(first, ([], []))
        own[0].append(item)
        own[1].append(tuple(rest))
    return e.ArrayOf(tuple(_nested(*row) for row in rows.values()), "array")


def with_parts(x: Any, change: Any) -> Any:
    """An expression with its parts changed."""

    def changed(value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(changed(item) for item in value)
        return change(value) if dataclasses.is_dataclass(value) and not isinstance(value, type) else value

    return dataclasses.replace(x, **{f.name: changed(getattr(x, f.name)) for f in dataclasses.fields(x)})
