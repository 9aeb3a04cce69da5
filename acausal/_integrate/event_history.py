"""What happened in a run, as its steps hand it on."""

from collections.abc import Callable
from typing import Any, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from .._equinox_private import written
from .._numbers import Numbers

Vector: TypeAlias = Float[Array, " n"]


LAST = 8  # how many of the last moments at which something happened are kept, for a failed run to name


class EventHistory(eqx.Module):
    """The events of a run, as far as there is room for them.

    - `times`, `numbers` (-1: none yet) and `before`: when each of the first listed events happened, which it was, and
      the stepped vector just before it, of which `before` keeps the first elements or none.
    - `count`: how many listed events there were, with or without room for them.
    - `last_times`, `last_happened`: the last moments at which anything happened, listed or not, and which events did.
    """

    times: Float[Array, " room"]
    numbers: Int[Array, " room"]
    before: Float[Array, "room n"]
    count: Array
    last_times: Float[Array, " last"]
    last_happened: Bool[Array, "last events"]

    @classmethod
    def empty(cls, size: int, n: int, n_events: int) -> "EventHistory":
        """A history with room for `size` events, of `n_events` that there are, and vectors of `n` elements."""
        first = jnp.full(size, jnp.inf), jnp.full(size, -1), jnp.zeros((size, n)), jnp.asarray(0)
        return cls(*first, jnp.full(LAST, jnp.inf), jnp.zeros((LAST, n_events), bool))

    def noted(self, when: Numbers, before: Vector, happened: Array, is_listed: np.ndarray) -> "EventHistory":
        """The history with the events that have happened at one moment."""
        if not happened.size:
            return self
        fired = happened & is_listed
        # Masks rather than scattered writes, with which XLA on CPU does not compile the loop of steps as one function.
        places = self.count + jnp.cumsum(fired) - 1
        mask = (jnp.arange(len(self.times))[:, None] == places) & fired
        is_new, numbers = jnp.any(mask, axis=1), jnp.sum(mask * jnp.arange(len(fired)), axis=1)
        n = self.before.shape[1]
        return EventHistory(
            jnp.where(is_new, when, self.times),
            jnp.where(is_new, numbers, self.numbers),
            jnp.where(is_new[:, None], before[:n], self.before),
            self.count + jnp.sum(fired),
            *self._with_last(jax.lax.stop_gradient(when), happened),
        )

    def emptied(self, n: int, size: int) -> "EventHistory":
        """A history of one instant, with room for `size` events and n elements, that knows the last moments."""
        n_events = self.last_happened.shape[1]
        new = EventHistory.empty(size, n, n_events)
        return eqx.tree_at(lambda h: (h.last_times, h.last_happened), new, (self.last_times, self.last_happened))

    def padded(self, size: int) -> "EventHistory":
        """The same with room for `size` events."""
        more = size - len(self.times)
        times = jnp.pad(self.times, (0, more), constant_values=jnp.inf)
        numbers, before = (
            jnp.pad(self.numbers, (0, more), constant_values=-1),
            jnp.pad(self.before, ((0, more), (0, 0))),
        )
        return EventHistory(times, numbers, before, self.count, self.last_times, self.last_happened)

    def followed_by(self, instant: "EventHistory", room: int, loop: Callable[..., Any]) -> "EventHistory":
        """The history with the events of another instant. Its rows are written one by one, so that the room for rows
        costs nothing in a step.
        """
        n = len(instant.times)

        def goes_on(carry: Any) -> Array:
            i, *_ = carry
            return (i < jnp.minimum(instant.count, n)) & (self.count + i < room)

        def write(carry: Any) -> Any:
            i, times, numbers, before = carry
            place, true = self.count + i, jnp.asarray(True)
            return (
                i + 1,
                written(times, instant.times[i], place, true),
                written(numbers, instant.numbers[i], place, true),
                written(before, instant.before[i], place, true),
            )

        start = (jnp.asarray(0), self.times, self.numbers, self.before)
        _, times, numbers, before = loop(goes_on, write, start, max_steps=n, buffers=lambda carry: carry[1:])
        count = self.count + instant.count
        return EventHistory(times, numbers, before, count, instant.last_times, instant.last_happened)

    def _with_last(self, when: Numbers, happened: Array) -> tuple[Array, Array]:
        is_any = jnp.any(happened)
        times = jnp.concatenate([self.last_times[1:], jnp.reshape(when, 1)])
        last = jnp.concatenate([self.last_happened[1:], happened[None]])
        return jnp.where(is_any, times, self.last_times), jnp.where(is_any, last, self.last_happened)
