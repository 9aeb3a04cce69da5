"""What happened in a run."""

from typing import TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._numbers import Numbers

Vector: TypeAlias = Float[Array, " n"]


LAST = 8  # how many of the last events are kept, for a failed run to name


class Record(eqx.Module):
    """The first events that are listed: `times`, `numbers` (-1: none yet), and the vectors `before`, or nothing of
    them; `count` is how many there were, recorded or not. What happened last, listed or not, is in `last_times` and
    `last_numbers`.
    """

    times: Float[Array, " records"]
    numbers: Int[Array, " records"]
    before: Float[Array, "records n"]
    count: Array
    last_times: Float[Array, " last"]
    last_numbers: Int[Array, " last"]

    @classmethod
    def empty(cls, size: int, n: int) -> "Record":
        """A record with room for `size` events and vectors of `n` elements."""
        first = jnp.full(size, jnp.inf), jnp.full(size, -1), jnp.zeros((size, n)), jnp.asarray(0)
        return cls(*first, jnp.full(LAST, jnp.inf), jnp.full(LAST, -1))

    def noted(self, when: Numbers, before: Vector, happened: Array, is_listed: np.ndarray) -> "Record":
        """The record with the events that have happened at one moment."""
        if not happened.size:
            return self
        fired = happened & is_listed
        # Masks rather than scattered writes, with which XLA on CPU does not compile the loop of steps as one function.
        places = self.count + jnp.cumsum(fired) - 1
        mask = (jnp.arange(len(self.times))[:, None] == places) & fired
        is_new, numbers = jnp.any(mask, axis=1), jnp.sum(mask * jnp.arange(len(fired)), axis=1)
        n = self.before.shape[1]
        return Record(
            jnp.where(is_new, when, self.times),
            jnp.where(is_new, numbers, self.numbers),
            jnp.where(is_new[:, None], before[:n], self.before),
            self.count + jnp.sum(fired),
            *self._with_last(jax.lax.stop_gradient(when), happened),
        )

    def _with_last(self, when: Numbers, happened: Array) -> tuple[Array, Array]:
        is_some = jnp.concatenate([self.last_numbers >= 0, happened])
        places = jnp.cumsum(is_some) - jnp.sum(is_some) + LAST - 1
        mask = (jnp.arange(LAST)[:, None] == places) & is_some
        numbers = jnp.concatenate([self.last_numbers, jnp.arange(len(happened))])
        times = jnp.concatenate([self.last_times, jnp.broadcast_to(when, happened.shape)])
        is_taken = jnp.any(mask, axis=1)
        return (
            jnp.where(is_taken, jnp.sum(jnp.where(mask, times, 0.0), axis=1), jnp.inf),
            jnp.where(is_taken, jnp.sum(jnp.where(mask, numbers, 0), axis=1), -1),
        )
