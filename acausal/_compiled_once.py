"""Numbers that several others are computed from, compiled once."""

import jax.numpy as jnp
from jax import Array

from ._numbers import Numbers


def compiled_once(index: Array, of_run: Numbers) -> Array:
    """The same index, where some number `of_run` is at hand.

    XLA on the CPU compiles what leads to a number anew for each operation that reads it, also behind
    `jax.lax.optimization_barrier`, but not behind a division. So the index is divided by one. XLA would leave that out,
    did the one not depend on a number of the run: it is a little more where that is NaN, and the quotient rounds to the
    same index.
    """
    one = jnp.where(jnp.isnan(of_run), 1.0 + 2.0**-52, 1.0)
    return jnp.round(index / one).astype(index.dtype)


def truths_compiled_once(of_run: Numbers, *truths: Array) -> list[Array]:
    """The same truth values, likewise, as the bits of one index."""
    bits = [jnp.where(truth, 1 << place, 0) for place, truth in enumerate(truths)]
    index = compiled_once(jnp.sum(jnp.stack(bits), axis=0), of_run)
    return [(index & (1 << place)) > 0 for place in range(len(truths))]
