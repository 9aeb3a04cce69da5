"""Resolution of names: from expressions of the flat model to terms over slots."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..._errors import ModelError
from .._syntax import expressions as e
from .._syntax.flat import FlatVariable
from .._syntax.visits import mapped, statements
from .evaluate import is_supported
from .known import KnownValues
from .leaves import ModelLeaf
from .paths import PathTree, nested, split
from .scope import NotKnown
from .slots import Previous, Slots
from .terms import Opaque, RecordOf, SlotValue, constant
from .values import Value, is_known


@dataclasses.dataclass
class Resolver:
    """Resolves names to leaves and known values.

    `leaves` are those of the model by Modelica name. `previous` makes the leaf that holds `pre` of another one.
    """

    known: KnownValues
    leaves: Mapping[str, ModelLeaf]
    previous: Previous

    def term(self, x: Any, slots: Slots, local: frozenset[str] = frozenset()) -> Any:
        """The term of an expression. Names in `local` stay as they are."""
        return _Resolution(self, slots, local).term(x)

    def body(self, body: e.Body, slots: Slots, local: frozenset[str]) -> e.Body:
        """Statements with resolved expressions, whose targets are names in `local`."""
        for s in statements(body):
            if isinstance(s, e.WhenClause | e.Reinit):
                raise ModelError(f"a {type(s).__name__.lower()} statement is not supported in an algorithm.")
        return mapped(body, _Resolution(self, slots, local).term)


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
                return e.FieldOf(self.term(x.base), x.name)
            case e.Subscript():
                return e.Subscript(self.term(x.base), self._subs(x.subs))
            case e.Comprehension():
                inner = _Resolution(self.model, self.slots, self.local | {name for name, _ in x.indices})
                return e.Comprehension(inner.term(x.body), tuple((name, self.term(over)) for name, over in x.indices))
            case e.Const() | e.Colon():
                return x
            case e.Text():
                return e.Text(self.term(x.arg))
        return mapped(x, self.term)

    def _subs(self, subs: Sequence[Any]) -> tuple[Any, ...]:
        ending = _Resolution(self.model, self.slots, self.local | {"end"})
        return tuple(ending.term(sub) for sub in subs)

    def _ref(self, x: e.Ref) -> Any:
        head = x.name.partition(".")[0]
        if x.name in self.local or head in self.local:
            return e.Ref(x.name, self._subs(x.subs))
        found = self._named(x.name)
        return e.Subscript(found, self._subs(x.subs)) if x.subs else found

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
            try:
                return constant(self.model.known.value_of(variable), name)
            except NotKnown as missing:
                raise ModelError(
                    f"the value of {name} is not known before a run, because it is a {variable.type}, which only a "
                    "declaration or modifier with known values can give."
                ) from missing
        return self._whole(self.model.known.tree.find(split(name)), name)

    def _whole(self, branch: PathTree[FlatVariable] | None, name: str) -> Any:
        if branch is None:
            raise ModelError(f"the name {name} is unknown.")
        if branch.item is not None:
            own = branch.item.name
            return e.Ref(own) if own in self.local else self._named(own)
        if branch.parts:
            return RecordOf(tuple((part, self._whole(inner, name)) for part, inner in branch.parts.items()))
        if not branch.members:
            raise ModelError(f"the name {name} is unknown.")
        members = {index: self._whole(inner, name) for index, inner in branch.members.items()}
        return nested(members, lambda items: e.ArrayOf(tuple(items)))

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
            return e.ArrayOf(tuple(self._pre(item) for item in x.elements))
        if isinstance(x, e.Ref) and x.name in self.local and x.name in self.model.leaves:
            x = e.Ref(x.name, x.subs)  # an output of an algorithm: its value before
            found = self._named(x.name)
            return self._previous(e.Subscript(found, self._subs(x.subs)) if x.subs else found)
        return self._previous(self.term(x))

    def _previous(self, found: Any) -> Any:
        match found:
            case SlotValue():
                leaf = self.slots.leaves[found.number]
                if leaf.role in ("param", "time"):
                    return found
                previous: Any = self.slots.slot(self.model.previous.leaf(leaf))
                now: Any = found
                # At the start, `pre` of a continuous variable is its value (Modelica 3.6, section 8.6).
                return previous if leaf.is_discrete else e.If(((self._named("initial_"), now),), previous)
            case e.Subscript():
                return e.Subscript(self._previous(found.base), found.subs)
            case e.ArrayOf():
                return e.ArrayOf(tuple(self._previous(item) for item in found.elements))
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
