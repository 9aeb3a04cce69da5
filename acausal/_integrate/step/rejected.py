"""Reverse mode through rejected steps, which do not affect the result."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import PyTree

from ..._tangents import masked
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

    return masked(lambda *args: _harmless(*attempt(*args)), counts)


def _harmless(core: Array, error: Array, others: PyTree) -> tuple[Array, Array, PyTree]:
    """The outcome of a step. If the step failed, its error is infinite and other non-finite numbers are zero."""
    is_good = jnp.all(jnp.isfinite(error)) & jnp.all(jnp.isfinite(core))
    finite = jax.tree.map(lambda x: jnp.where(is_good | jnp.isfinite(x), x, jnp.zeros_like(x)), (core, others))
    return finite[0], jnp.where(is_good, error, jnp.inf), finite[1]
