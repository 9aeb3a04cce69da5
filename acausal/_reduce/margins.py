"""Truth values as margins: real numbers that are positive where a relation holds, so that its onset can be located."""

from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
from jax.extend.core import ClosedJaxpr, JaxprEqn, Literal

from .jaxpr import bind, called, is_floating

LEAST = 1e-300  # in place of zero, whose sign tells whether a relation holds between equal numbers


def _margin_of(difference: Callable[[Any, Any], Any], of_equals: float) -> Callable[[Any, Any], Any]:
    """The difference, which keeps its derivative where it is zero."""
    return lambda a, b: difference(a, b) + jnp.where(a == b, of_equals, 0.0)


_RELATIONS: dict[str, Callable[[Any, Any], Any]] = {
    "gt": _margin_of(lambda a, b: a - b, -LEAST),
    "ge": _margin_of(lambda a, b: a - b, LEAST),
    "lt": _margin_of(lambda a, b: b - a, -LEAST),
    "le": _margin_of(lambda a, b: b - a, LEAST),
}
_LOGIC: dict[str, Callable[..., Any]] = {
    "and": jnp.minimum,
    "or": jnp.maximum,
    "not": lambda a: -a,
    "copy": lambda a: a,
    "squeeze": lambda a: a,
}


def margins(closed: ClosedJaxpr, inputs: list[Any]) -> list[Any]:
    """The outputs of a jaxpr, each truth value as its margin; real outputs as they are.

    The margin of a relation is the difference of its sides, where these are equal a tiny number of the right sign; of
    `&` it is the smaller one, of `|` the larger one. What is neither, such as a comparison of modes, has the margin 1
    or -1.
    """
    jaxpr = closed.jaxpr
    values: dict[Any, Any] = dict(zip(jaxpr.invars, inputs, strict=True))
    values |= dict(zip(jaxpr.constvars, closed.consts, strict=True))
    found: dict[Any, Any] = {}

    def read(atom: Any) -> Any:
        return jnp.asarray(atom.val) if isinstance(atom, Literal) else values[atom]

    def margin(atom: Any) -> Any:
        return found[atom] if not isinstance(atom, Literal) and atom in found else jnp.where(read(atom), 1.0, -1.0)

    for eqn in jaxpr.eqns:
        args = [read(atom) for atom in eqn.invars]
        values |= dict(zip(eqn.outvars, bind(eqn, args), strict=True))
        if (inner := called(eqn)) is not None:
            found |= dict(zip(eqn.outvars, margins(inner, args), strict=True))
        elif (value := _margin(eqn, args, margin)) is not None:
            found[eqn.outvars[0]] = value
    return [margin(atom) if atom.aval.dtype == bool else read(atom) for atom in jaxpr.outvars]


def _margin(eqn: JaxprEqn, args: list[Any], margin: Callable[[Any], Any]) -> Any:
    name = eqn.primitive.name
    if name in _RELATIONS and is_floating(eqn.invars[0]):
        return _RELATIONS[name](*args)
    if name in _LOGIC and eqn.outvars[0].aval.dtype == bool:  # pyright: ignore[reportAttributeAccessIssue]
        return _LOGIC[name](*(margin(atom) for atom in eqn.invars))
    return None
