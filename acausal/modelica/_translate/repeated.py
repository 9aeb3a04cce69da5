"""Loops of a length that is known only at run time, with derivatives in both modes."""

from collections.abc import Callable
from typing import Any

import jax
from jax.flatten_util import ravel_pytree
from jaxtyping import PyTree


def repeated(goes_on: Callable[[PyTree], Any], turn: Callable[[PyTree], PyTree], start: PyTree) -> PyTree:
    """Repeats `turn` while `goes_on`. Both may close over numbers that are differentiated.

    The tangent is the Jacobian, from forward mode, times the tangents of the inputs. JAX can transpose this product,
    but not the tangent of a loop.
    """

    def loop(first: jax.Array) -> jax.Array:
        return ravel_pytree(jax.lax.while_loop(goes_on, turn, state_of(first)))[0]

    first, state_of = ravel_pytree(start)
    explicit, closed_over = jax.closure_convert(loop, first)
    inputs, arguments_of = ravel_pytree((first, closed_over))

    def once(inputs: jax.Array) -> jax.Array:
        first, closed_over = arguments_of(inputs)
        return explicit(first, *closed_over)

    end = jax.custom_jvp(once)

    @end.defjvp
    def _tangent(primals: tuple[jax.Array], tangents: tuple[jax.Array]) -> tuple[jax.Array, jax.Array]:
        return end(*primals), jax.jacfwd(once)(*primals) @ tangents[0]

    return state_of(end(inputs))
