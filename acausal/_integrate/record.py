"""What happened in a run."""

from typing import Any, TypeAlias

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

Vector: TypeAlias = Float[Array, " n"]


class Record(eqx.Module):
    """The first events: `times`, `numbers` (-1: none yet), and the vectors `before`, or nothing of them; `count` is how
    many there were, recorded or not.
    """

    times: Float[Array, " records"]
    numbers: Int[Array, " records"]
    before: Float[Array, "records n"]
    count: Any

    @classmethod
    def empty(cls, size: int, n: int) -> "Record":
        """A record with room for `size` events and vectors of `n` elements."""
        return cls(jnp.full(size, jnp.inf), jnp.full(size, -1), jnp.zeros((size, n)), jnp.asarray(0))

    def noted(self, when: Any, before: Vector, fired: Any) -> "Record":
        """The record with the events that have fired at one moment."""
        if not fired.size:
            return self
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
        )
