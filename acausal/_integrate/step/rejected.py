"""Reverse mode through steps that are rejected: nothing depends on them."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import PyTree

from ..setup.field import Given
from ..setup.settings import Settings
from .controller import is_rejected

# A step: from the core of the vector and the numbers of the run to its end, its error, and whatever else it leaves.
Attempt = Callable[[Array, Given, PyTree], tuple[Array, Array, PyTree]]


def rejectable(attempt: Attempt, settings: Settings) -> Attempt:
    """The step that `attempt` takes, without derivatives where it is rejected.

    A step may be so long that the equations have no root at its end, or a slope without bound, as that of a square
    root. The controller rejects it, but reverse mode would multiply what is not used, zero, by these slopes. So the
    tangents of all arguments and of the outcome are replaced by zero where the step does not count; transposed, that
    replaces the cotangents.
    """

    def counts(args: tuple[Array, Given, PyTree], outcome: tuple[Array, Array, PyTree]) -> Array:
        core, given, _ = args
        return ~is_rejected(settings, *jax.lax.stop_gradient((given.numbers.rtol, core, *outcome[:2])))

    return _masked(lambda *args: _harmless(*attempt(*args)), counts)


def _harmless(core: Array, error: Array, others: PyTree) -> tuple[Array, Array, PyTree]:
    """The outcome of a step; of a failed one the error is infinite, and what else is not finite is zero."""
    is_good = jnp.all(jnp.isfinite(error)) & jnp.all(jnp.isfinite(core))
    finite = jax.tree.map(lambda x: jnp.where(is_good | jnp.isfinite(x), x, jnp.zeros_like(x)), (core, others))
    return finite[0], jnp.where(is_good, error, jnp.inf), finite[1]


def _masked(function: Callable[..., PyTree], is_good: Callable[..., Array]) -> Callable[..., Any]:
    """A function whose derivatives are zero where its arguments and its value are not good."""

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
