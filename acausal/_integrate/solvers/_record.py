"""What happened in a run."""

from typing import Any, TypeAlias

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

Vector: TypeAlias = Float[Array, " n"]
AT_ONCE = 8  # events of one instant that are recorded


class Record(eqx.Module):
    """The first events: `times`, `numbers` (-1: none yet), and the vectors `before` and `after`, or nothing of them.

    `count` is how many there were; `last_time` and `last_number` tell of the last one, recorded or not.
    """

    times: Float[Array, " records"]
    numbers: Int[Array, " records"]
    before: Float[Array, "records n"]
    after: Float[Array, "records n"]
    count: Any
    last_time: Any
    last_number: Any

    @classmethod
    def empty(cls, size: int, n: int) -> "Record":
        """A record with room for `size` events and vectors of `n` elements."""
        times, numbers, vectors = jnp.full(size, jnp.inf), jnp.full(size, -1), jnp.zeros((size, n))
        return cls(times, numbers, vectors, vectors, jnp.asarray(0), jnp.asarray(-jnp.inf), jnp.asarray(-1))

    def noted(self, when: Any, before: Vector, after: Vector, fired: Any) -> "Record":
        """The record with the events that have fired at one moment."""
        size = min(AT_ONCE, len(fired))
        numbers = jnp.nonzero(fired, size=size, fill_value=-1)[0]
        places = jnp.where(numbers >= 0, self.count + jnp.arange(size), len(self.times))
        n = self.before.shape[1]
        return Record(
            self.times.at[places].set(when, mode="drop"),
            self.numbers.at[places].set(numbers, mode="drop"),
            self.before.at[places].set(before[:n], mode="drop"),
            self.after.at[places].set(after[:n], mode="drop"),
            self.count + jnp.sum(fired),
            jnp.asarray(when, float),
            numbers[0],
        )
