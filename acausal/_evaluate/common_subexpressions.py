"""Common subexpression elimination: separate equations compute equal terms, such as properties of one liquid."""

from collections.abc import Callable, Hashable, Sequence
from typing import Any, TypeVar

import jax
import numpy as np

from .._jax_private import Atom, ClosedJaxpr, JaxprEqn, Literal, jaxpr_as_fun
from .._reduce.jaxpr import assembled

T = TypeVar("T")


def once(function: Callable[[], T]) -> T:
    """The result of a function, a pytree of arrays, where equal operations on the same numbers are evaluated once."""
    closed, shapes = jax.make_jaxpr(function, return_shape=True)()
    return jax.tree.unflatten(jax.tree.structure(shapes), jaxpr_as_fun(without_repetition(closed))())


def without_repetition(closed: ClosedJaxpr) -> ClosedJaxpr:
    """A program without repeated operations on the same inputs, and without unused ones."""
    jaxpr = closed.jaxpr
    read = {_name(atom) for eqn in jaxpr.eqns for atom in eqn.invars} | {_name(atom) for atom in jaxpr.outvars}
    same: dict[Any, Any] = {}  # an earlier variable with the same value
    kept: list[JaxprEqn] = []
    places: dict[Hashable, int] = {}
    for eqn in jaxpr.eqns:
        inputs: list[Any] = [atom if isinstance(atom, Literal) else same.get(atom, atom) for atom in eqn.invars]
        key = _computes(eqn, inputs)
        place = places.get(key)
        if place is None:
            places[key] = len(kept)
            kept.append(eqn.replace(invars=inputs))
            continue
        pairs = list(zip(kept[place].outvars, eqn.outvars, strict=True))
        same.update((new, old) for old, new in pairs if old in read)
        kept[place] = kept[place].replace(outvars=[old if old in read else new for old, new in pairs])
    outputs: list[Any] = [atom if isinstance(atom, Literal) else same.get(atom, atom) for atom in jaxpr.outvars]
    return ClosedJaxpr(assembled(jaxpr.invars, outputs, _needed(kept, outputs), jaxpr.constvars), closed.consts)


def _needed(eqns: Sequence[JaxprEqn], outputs: Sequence[Atom]) -> list[JaxprEqn]:
    needed, found = {_name(atom) for atom in outputs}, []
    for eqn in reversed(eqns):
        if any(var in needed for var in eqn.outvars):
            found.append(eqn)
            needed.update(map(_name, eqn.invars))
    return found[::-1]


def _computes(eqn: JaxprEqn, inputs: Sequence[Atom]) -> Hashable:
    """A key of an operation and its inputs; unique if its result may differ each time."""
    key = eqn.primitive, tuple(map(_name, inputs)), tuple(sorted(eqn.params.items()))
    try:
        hash(key)
    except TypeError:
        return object()
    return key


def _name(atom: Atom) -> Hashable:
    """A key of a variable, or of a literal by type and bits, since zeros of both signs are equal."""
    return (atom.aval, np.asarray(atom.val).tobytes()) if isinstance(atom, Literal) else atom
