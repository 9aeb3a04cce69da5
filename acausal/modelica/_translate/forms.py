"""Equations of one form: a component class whose leaves are the slots of terms."""

import dataclasses
import hashlib
from collections.abc import Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np

from ..._declare.annotations import Declaration, positive
from ..._declare.component import Component, Equations, eq
from .._syntax import expressions as e
from .evaluate import evaluate
from .execute import execute
from .leaves import ModelLeaf
from .nodes import instance, node_class
from .scope import FunctionLibrary, Scope, located
from .terms import RecordOf, SlotValue
from .values import Value, first, number


@dataclasses.dataclass(frozen=True)
class Residual:
    """Equations: the term is zero, or both sides of a difference are equal."""

    term: Any

    def residuals(self, at: Scope) -> list[Value]:
        if isinstance(self.term, e.Binary) and self.term.op == "Sub":
            left, right = as_numbers(self.term.left), as_numbers(self.term.right)
            return _differences(evaluate(left, at), evaluate(right, at))
        return _differences(evaluate(_branches_as_numbers(self.term), at), None)

    def size(self, at: Scope) -> float:
        """The largest of the numbers whose sum or difference must vanish."""
        found = [item for x in _addends(self.term) for item in _differences(evaluate(as_numbers(x), at), None)]
        return max((float(np.max(np.abs(item), initial=0.0)) for item in found), default=0.0)


@dataclasses.dataclass(frozen=True)
class AlgorithmForm:
    """An algorithm: its statements, and for each name that it sets the slot and the value before it."""

    body: e.Body
    outputs: tuple[tuple[str, Any, Any], ...]

    def residuals(self, at: Scope) -> list[Value]:
        names = {name: evaluate(before, at) for name, _, before in self.outputs}
        execute(self.body, names, at, is_whole=True)
        found = []
        for name, slot, _ in self.outputs:
            found += _differences(evaluate(as_numbers(slot), at), names[name])
        return found


def as_numbers(x: Any) -> Any:
    """A side of an equation whose Boolean variables count as numbers, for which the equation can be solved."""
    match x:
        case SlotValue(kind="boolean"):
            return dataclasses.replace(x, kind="real")
        case e.Subscript() | e.FieldOf():
            return dataclasses.replace(x, base=as_numbers(x.base))
        case e.Builtin("Cat" | "Matrix", args):
            return e.Builtin(x.name, tuple(map(as_numbers, args)))
        case e.ArrayOf() | e.TupleOf():
            return dataclasses.replace(x, elements=tuple(item and as_numbers(item) for item in x.elements))
        case RecordOf():
            return RecordOf(tuple((name, as_numbers(item)) for name, item in x.fields))
    return x


def _branches_as_numbers(term: Any) -> Any:
    """The term of an if-equation, with the equations in its branches as differences of numbers."""
    match term:
        case e.If():
            branches = tuple((condition, _branches_as_numbers(branch)) for condition, branch in term.branches)
            return dataclasses.replace(term, branches=branches, otherwise=_branches_as_numbers(term.otherwise))
        case e.Binary(op="Sub"):
            return dataclasses.replace(term, left=as_numbers(term.left), right=as_numbers(term.right))
    return term


def _differences(left: Value, right: Value) -> list[Value]:
    if isinstance(left, tuple):
        results = right if isinstance(right, tuple) else (right,)
        pairs = [pair for pair in zip(left, results, strict=False) if pair[0] is not None]
        return [item for a, b in pairs for item in _differences(a, b)]
    if isinstance(left, dict):
        return [item for name in left for item in _differences(left[name], None if right is None else right[name])]
    if isinstance(left, str):
        return []
    left, right = number(left), first(right)
    if right is None:
        return [left]
    if isinstance(right, dict) and not np.ndim(left):  # a record of one field that stands for a number
        return [item for value in right.values() for item in _differences(left, value)]
    right = number(right)
    if np.shape(left) != np.shape(right):
        raise TypeError(f"the sides have different shapes: {np.shape(left)} and {np.shape(right)}.")
    return [left - right]


def _addends(term: Any) -> list[Any]:
    if isinstance(term, e.Binary) and term.op in ("Add", "Sub"):
        return [*_addends(term.left), *_addends(term.right)]
    return [] if isinstance(term, e.TupleOf | e.If) else [term]


Form = Residual | AlgorithmForm


class EquationForm(Component, partial=True):
    """Base class of forms of Modelica equations."""


def declaration_of(leaf: ModelLeaf) -> Declaration:
    """The declaration of a leaf."""
    return Declaration(
        role=leaf.role,
        unit=leaf.unit,
        sign=positive if leaf.is_positive else None,
        select=leaf.select,
        nominal=leaf.nominal,
        sizes=leaf.dims,
        start=leaf.guess if leaf.role in ("var", "discrete") else 0.0,
        is_unbounded=leaf.role == "param",
        counts_from_1=True,
        title=leaf.title,
    )


def form_class(
    form: Form, leaves: Sequence[ModelLeaf], functions: FunctionLibrary, *, is_initial: bool, name: str, place: str
) -> Component:
    """A component whose leaves are the slots of a form. Errors of its evaluation name `place`."""
    names = [f"x{i}" for i in range(len(leaves))]
    roles = [leaf.role for leaf in leaves]
    constant = {"time": 1.0}  # rates; those of parameters and discrete variables are not asked for

    def equations(self: Any, d: Any) -> Equations:
        at = Scope(
            functions,
            [getattr(self, name) for name in names],
            [getattr(d, x) if role == "var" else constant.get(role) for x, role in zip(names, roles, strict=True)],
            holds=not is_initial,
        )
        with located(place):
            found = [item for item in form.residuals(at) if np.size(item)]
        stated = [eq(jnp.asarray(item, float), check_units=False) for item in found]
        return {name if len(stated) == 1 else f"{name}_{i}": item for i, item in enumerate(stated)}

    digest = hashlib.sha256(repr((form, [dataclasses.astuple(declaration_of(leaf)) for leaf in leaves])).encode())
    cls = node_class(
        EquationForm,
        f"Equation_{digest.hexdigest()[:16]}",
        {name: declaration_of(leaf) for name, leaf in zip(names, leaves, strict=True)},
        {"initial_equations" if is_initial else "equations": equations},
    )
    cls.__name__ = name  # as messages show it; the name with the digest identifies the class in another process
    return instance(cls, dict.fromkeys(names, 0.0))
