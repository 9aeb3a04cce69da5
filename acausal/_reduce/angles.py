"""The phases of a function: the arguments of its sines and cosines, and its steps, namely rounded values and positions
in lookup tables.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import PyTree

from .._jax_private import ClosedJaxpr, JaxprEqn
from .jaxpr import bind, called, differentiable_call, interpreted, is_floating, shape_of

_WAVES = ("sin", "cos", "tan")
_STAIRS = {"floor": 0.0, "ceil": 0.0, "round": 0.5}


class Traced(NamedTuple):
    """The value of a function and its phases.

    `angles` in rad are the arguments of sines and cosines, then those of the steps, where one step counts as a full
    turn. `steps` is the sum of the step numbers; it changes with any of them.
    """

    value: Array
    angles: Array
    steps: Array


def with_angles(function: Callable[..., PyTree]) -> Callable[..., Traced]:
    """The function with its phases, except those computed within loops."""

    def both(*x: Array) -> Traced:
        closed, shape = jax.make_jaxpr(function, return_shape=True)(*x)
        angles, stairs = [jnp.zeros(0)], [jnp.zeros(0)]
        values = _walk(closed, jax.tree.leaves(x), angles, stairs)
        heights = jnp.concatenate(stairs)
        turns = jnp.concatenate([*angles, 2.0 * math.pi * heights])
        return Traced(jax.tree.unflatten(jax.tree.structure(shape), values), turns, jnp.sum(jnp.floor(heights)))

    return both


def _walk(closed: ClosedJaxpr, inputs: Sequence[Array], angles: list[Array], stairs: list[Array]) -> list[Array]:
    """The outputs. Appends angles and steps on the way."""

    def outputs(eqn: JaxprEqn, args: list[Array]) -> list[Array]:
        inner = called(eqn)
        if inner is not None and _turns(inner):
            return _walk(inner, args, angles, stairs)
        results = bind(eqn, args)
        _note(eqn, args, angles, stairs)
        return results

    return interpreted(closed, inputs, outputs, jnp.asarray)


def _note(eqn: JaxprEqn, args: Sequence[Array], angles: list[Array], stairs: list[Array]) -> None:
    name = eqn.primitive.name
    if name in _WAVES:
        angles.append(jnp.ravel(args[0]))
    elif name in _STAIRS:
        stairs.append(jnp.ravel(args[0]) + _STAIRS[name])
    elif name == "rem" and is_floating(eqn.invars[0]):
        stairs.append(jnp.ravel(args[0] / args[1]))
    elif _looks_up(eqn):
        table, x, bound, _ = args
        stairs.append(jnp.ravel(_place(table, x, jnp.ndim(bound))))
    for body in _bodies(eqn):
        if _turns(body):
            _walk(body, args[len(args) - len(body.jaxpr.invars) :], angles, stairs)


def _turns(closed: ClosedJaxpr) -> bool:
    """Whether a jaxpr takes sines or cosines, or has steps."""
    names = (*_WAVES, *_STAIRS, "rem")
    return any(
        eqn.primitive.name in names or _looks_up(eqn) or any(map(_turns, _bodies(eqn))) for eqn in closed.jaxpr.eqns
    )


def _looks_up(eqn: JaxprEqn) -> bool:
    """Whether an equation is a search in a sorted list by `jnp.interp` or `jnp.digitize`: a loop that narrows two
    indices.
    """
    if eqn.primitive.name != "scan" or len(eqn.invars) != 4:
        return False
    table, x, *bounds = eqn.invars
    is_search = is_floating(table) and is_floating(x) and not any(map(is_floating, bounds))
    return is_search and len(shape_of(table)) > 0


def _place(table: Array, x: Array, rank: int) -> Array:
    """Position of x among the samples of a table, an integer at each of them. The result has `rank` axes."""
    if table.ndim > 1:  # in an array of components, with one x for each of them, or for all
        axis = 0 if jnp.ndim(x) == rank else None
        return jax.vmap(lambda table, x: _place(table, x, rank - 1), (0, axis))(table, x)
    return jnp.interp(x, table, jnp.arange(len(table), dtype=float))


def _bodies(eqn: JaxprEqn) -> list[ClosedJaxpr]:
    """The jaxprs of an equation other than a loop, applied to its last arguments."""
    branches = eqn.params["branches"] if eqn.primitive.name == "cond" else ()
    return [body for body in (called(eqn), differentiable_call(eqn), *branches) if body is not None]
