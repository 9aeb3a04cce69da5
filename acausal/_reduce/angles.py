"""The angles that a function turns through, of which it takes sines and cosines, and its stairs: whole numbers that it
takes, and samples between which it looks something up.
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
    """The value of a function, and what turns in it.

    `angles` in rad are those that it takes sines and cosines of, then the heights of its stairs, of which a step counts
    as a full turn. `steps` is the sum of the steps on which the stairs are: it tells whether any has changed.
    """

    value: Array
    angles: Array
    steps: Array


def with_angles(function: Callable[..., PyTree]) -> Callable[..., Traced]:
    """The function, and what turns in it, besides what a loop inside it computes."""

    def both(*x: Array) -> Traced:
        closed, shape = jax.make_jaxpr(function, return_shape=True)(*x)
        angles, stairs = [jnp.zeros(0)], [jnp.zeros(0)]
        values = _walk(closed, jax.tree.leaves(x), angles, stairs)
        heights = jnp.concatenate(stairs)
        turns = jnp.concatenate([*angles, 2.0 * math.pi * heights])
        return Traced(jax.tree.unflatten(jax.tree.structure(shape), values), turns, jnp.sum(jnp.floor(heights)))

    return both


def _walk(closed: ClosedJaxpr, inputs: Sequence[Array], angles: list[Array], stairs: list[Array]) -> list[Array]:
    """The outputs; notes angles and heights of stairs on the way."""

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
    """Whether a jaxpr takes sines or cosines, or has stairs."""
    names = (*_WAVES, *_STAIRS, "rem")
    return any(
        eqn.primitive.name in names or _looks_up(eqn) or any(map(_turns, _bodies(eqn))) for eqn in closed.jaxpr.eqns
    )


def _looks_up(eqn: JaxprEqn) -> bool:
    """Whether it is a search in a sorted list, as `jnp.interp` and `jnp.digitize` make it: a loop that narrows down two
    indices.
    """
    if eqn.primitive.name != "scan" or len(eqn.invars) != 4:
        return False
    table, x, *bounds = eqn.invars
    is_search = is_floating(table) and is_floating(x) and not any(map(is_floating, bounds))
    return is_search and len(shape_of(table)) > 0


def _place(table: Array, x: Array, rank: int) -> Array:
    """Where x is among the samples of a table; a whole number at each of them. What is found has `rank` axes."""
    if table.ndim > 1:  # those of an array of components, with one x for each of them, or for all
        axis = 0 if jnp.ndim(x) == rank else None
        return jax.vmap(lambda table, x: _place(table, x, rank - 1), (0, axis))(table, x)
    return jnp.interp(x, table, jnp.arange(len(table), dtype=float))


def _bodies(eqn: JaxprEqn) -> list[ClosedJaxpr]:
    """What an equation computes from its last arguments, if it is no loop."""
    branches = eqn.params["branches"] if eqn.primitive.name == "cond" else ()
    return [body for body in (called(eqn), differentiable_call(eqn), *branches) if body is not None]
