"""Jaxprs as data that another process can read, so that it does not trace again."""

from collections.abc import Hashable
from typing import Any

import numpy as np

from .._jax_private import NAMED_PRIMITIVES, ClosedJaxpr, DebugInfo, Jaxpr, Literal, Var, new_equation, shaped

# Of each jaxpr: kinds of its values, its constants with their values, inputs, equations and outputs. A value is a place
# in the list of kinds, and a literal a negative place in the list of literals, from -1.
Tape = dict[str, Any]


class NotStorableError(Exception):
    """A primitive or a parameter cannot be found again in another process."""


def tape_of(closed: ClosedJaxpr) -> Tape:
    """A simplified jaxpr as lists, tuples and dictionaries. Raises `NotStorableError`."""
    writer = _Writer()
    root = writer.closed(closed)
    return {"root": root, "jaxprs": writer.jaxprs, "parameters": writer.parameters, "primitives": writer.primitives}


def closed_of(tape: Tape) -> ClosedJaxpr:
    """The jaxpr that `tape_of` has written."""
    return _Reader(tape).closed(tape["root"])


class _Inner:
    """The place of an inner jaxpr in the parameters of an equation, and whether it stands there without constants."""

    def __init__(self, place: int, is_open: bool = False) -> None:
        self.place, self.is_open = place, is_open


class _Writer:
    def __init__(self) -> None:
        self.jaxprs: list[Any] = []
        self.parameters: list[Any] = []
        self.primitives: list[str] = []
        self._places: dict[Hashable, int] = {}
        self._kept: list[Any] = []  # their identities are keys

    def closed(self, closed: ClosedJaxpr) -> int:
        key = ("jaxpr", id(closed))
        if key not in self._places:
            self._kept.append(closed)
            found = self._jaxpr(closed)
            self._places[key] = len(self.jaxprs)
            self.jaxprs.append(found)
        return self._places[key]

    def _jaxpr(self, closed: ClosedJaxpr) -> Any:
        jaxpr, kinds, literals = closed.jaxpr, [], []
        places: dict[Var, int] = {}

        def place(atom: Any) -> int:
            kind = _kind(atom)
            if isinstance(atom, Literal):
                literals.append((np.asarray(atom.val, kind[1]), kind))
                return -len(literals)
            if atom not in places:
                places[atom] = len(kinds)
                kinds.append(kind)
            return places[atom]

        def row(atoms: Any) -> tuple[int, ...]:
            return tuple(map(place, atoms))

        constants = row(jaxpr.constvars), [np.asarray(value) for value in closed.consts]
        takes = row(jaxpr.invars)
        eqns = [
            (self._primitive(eqn.primitive), self._parameters(eqn.params), row(eqn.invars), row(eqn.outvars))
            for eqn in jaxpr.eqns
        ]
        return kinds, literals, constants, takes, eqns, row(jaxpr.outvars)

    def _primitive(self, primitive: Any) -> int:
        if NAMED_PRIMITIVES.get(primitive.name) is not primitive:
            raise NotStorableError(primitive.name)
        return self._place(("primitive", primitive.name), self.primitives, primitive.name)

    def _parameters(self, params: dict[str, Any]) -> int:
        written = {name: self._value(value) for name, value in params.items()}
        key = tuple((name, type(v), v.place if isinstance(v, _Inner) else v) for name, v in written.items())
        try:
            return self._place(("parameters", key), self.parameters, written)
        except TypeError:  # without a hash
            self.parameters.append(written)
            return len(self.parameters) - 1

    def _value(self, value: Any) -> Any:
        if isinstance(value, ClosedJaxpr):
            return _Inner(self.closed(value))
        if isinstance(value, Jaxpr):  # of a scatter
            return _Inner(self.closed(ClosedJaxpr(value, ())), is_open=True)
        if isinstance(value, tuple) and any(isinstance(part, ClosedJaxpr) for part in value):
            return tuple(map(self._value, value))
        return value

    def _place(self, key: Hashable, table: list[Any], entry: Any) -> int:
        found = self._places.get(key)
        if found is None:
            found = self._places[key] = len(table)
            table.append(entry)
        return found


def _kind(atom: Any) -> tuple[tuple[int, ...], str, bool]:
    aval = atom.aval
    if np.dtype(aval.dtype.str) != aval.dtype:
        raise NotStorableError(str(aval.dtype))
    return aval.shape, aval.dtype.str, bool(aval.weak_type)


class _Reader:
    def __init__(self, tape: Tape) -> None:
        self._jaxprs, self._primitives = tape["jaxprs"], [NAMED_PRIMITIVES[name] for name in tape["primitives"]]
        self._made: dict[int, ClosedJaxpr] = {}
        self._shapes: dict[Any, Any] = {}
        self._parameters = tape["parameters"]

    def closed(self, place: int) -> ClosedJaxpr:
        if place not in self._made:
            self._made[place] = self._jaxpr(*self._jaxprs[place])
        return self._made[place]

    def _jaxpr(self, kinds: Any, literals: Any, constants: Any, takes: Any, eqns: Any, gives: Any) -> ClosedJaxpr:
        values = [Var(self._shape(kind)) for kind in kinds]
        values += [Literal(value, self._shape(kind)) for value, kind in reversed(literals)]  # found by negative places

        def atoms(places: Any) -> list[Any]:
            return [values[i] for i in places]

        made = [
            new_equation(atoms(ins), atoms(outs), self._primitives[primitive], self._values(self._parameters[params]))
            for primitive, params, ins, outs in eqns
        ]
        jaxpr = Jaxpr(atoms(constants[0]), atoms(takes), atoms(gives), made, debug_info=_NO_SOURCE)
        return ClosedJaxpr(jaxpr, constants[1])

    def _shape(self, kind: Any) -> Any:
        if kind not in self._shapes:
            self._shapes[kind] = shaped(*kind)
        return self._shapes[kind]

    def _values(self, params: dict[str, Any]) -> dict[str, Any]:
        return {name: self._value(value) for name, value in params.items()}

    def _value(self, value: Any) -> Any:
        if isinstance(value, _Inner):
            closed = self.closed(value.place)
            return closed.jaxpr if value.is_open else closed
        if isinstance(value, tuple) and any(isinstance(part, _Inner) for part in value):
            return tuple(map(self._value, value))
        return value


_NO_SOURCE = DebugInfo("acausal", "stored", None, None)
