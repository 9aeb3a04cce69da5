"""Reverse mode through rejected steps, which do not affect the result."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import PyTree

from ..setup.field import RunArgs
from ..setup.settings import Settings
from .controller import is_rejected

# A step: maps the core of the vector and the numbers of the run to its end, its error and its other results.
Attempt = Callable[[Array, RunArgs, PyTree], tuple[Array, Array, PyTree]]


def rejectable(attempt: Attempt, settings: Settings) -> Attempt:
    """The step function `attempt`, with zero derivatives if the step is rejected.

    A step may be so long that the equations at its end have no root or an unbounded slope, such as that of a square
    root. The controller rejects it, but reverse mode would multiply its zero cotangents by these slopes. Therefore the
    tangents, and by transposition the cotangents, of the arguments and the outcome of a rejected step are set to zero.
    """

    def counts(arguments: tuple[Array, RunArgs, PyTree], outcome: tuple[Array, Array, PyTree]) -> Array:
        core, args, _ = arguments
        return ~is_rejected(settings, *jax.lax.stop_gradient((args.numbers.rtol, core, *outcome[:2])))

    return _masked(lambda *args: _harmless(*attempt(*args)), counts)


def _harmless(core: Array, error: Array, others: PyTree) -> tuple[Array, Array, PyTree]:
    """The outcome of a step. If the step failed, its error is infinite and other non-finite numbers are zero."""
    is_good = jnp.all(jnp.isfinite(error)) & jnp.all(jnp.isfinite(core))
    finite = jax.tree.map(lambda x: jnp.where(is_good | jnp.isfinite(x), x, jnp.zeros_like(x)), (core, others))
    return finite[0], jnp.where(is_good, error, jnp.inf), finite[1]


def _masked(function: Callable[..., PyTree], is_good: Callable[..., Array]) -> Callable[..., Any]:
    """A function with zero derivatives unless `is_good` holds for its arguments and its value."""

    def pushed(primals: tuple[PyTree, ...], tangents: tuple[PyTree, ...]) -> tuple[PyTree, PyTree]:
        moves = jax.tree.map(lambda dx: dx is not None, tangents, is_leaf=lambda dx: dx is None)
        moving, held = eqx.partition(primals, moves)

        def of_moving(moving: PyTree) -> tuple[PyTree, PyTree]:
            return eqx.partition(function(*eqx.combine(moving, held)), eqx.is_inexact_array)

        changing, push, rest = jax.linearize(of_moving, moving, has_aux=True)
        value = eqx.combine(changing, rest)

        is_used = is_good(primals, value)

        def where_good(tangents: PyTree) -> PyTree:
            return jax.tree.map(lambda dx: jnp.where(is_used, dx, 0.0), tangents)

        return value, where_good(push(where_good(tangents)))

    masked = eqx.filter_custom_jvp(function)
    masked.def_jvp(pushed)
    return masked
