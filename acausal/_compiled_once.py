"""Common subexpressions that XLA compiles once instead of once for each use."""

import jax.numpy as jnp
from jax import Array

from ._numbers import Numbers


def compiled_once(index: Array, of_run: Numbers) -> Array:
    """The same index, compiled once. `of_run` is any number of the run.

    XLA on the CPU duplicates the computation of a number for each operation that reads it, even across
    `jax.lax.optimization_barrier`, but not across a division. So the index is divided by one. XLA would remove a
    constant one, so it depends on a number of the run: it is slightly larger if that is NaN, and the quotient rounds to
    the same index.
    """
    one = jnp.where(jnp.isnan(of_run), 1.0 + 2.0**-52, 1.0)
    return jnp.round(index / one).astype(index.dtype)


def truths_compiled_once(of_run: Numbers, *truths: Array) -> list[Array]:
    """The same truth values, compiled once, as the bits of one index."""
    bits = [jnp.where(truth, 1 << place, 0) for place, truth in enumerate(truths)]
    index = compiled_once(jnp.sum(jnp.stack(bits), axis=0), of_run)
    return [(index & (1 << place)) > 0 for place in range(len(truths))]
