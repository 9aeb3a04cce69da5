"""What happened in a run, as its steps hand it on."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from .._numbers import Numbers

LAST = 8  # how many of the last moments at which something happened are kept, for a failed run to name


class EventHistory(eqx.Module):
    """The events of a run, as far as there is room for them.

    - `times`, `numbers` (-1: none yet): when each of the first listed events happened, and which it was.
    - `count`: how many listed events there were, with or without room for them.
    - `last_times`, `last_happened`: the last moments at which anything happened, listed or not, and which events did.
    """

    times: Float[Array, " room"]
    numbers: Int[Array, " room"]
    count: Array
    last_times: Float[Array, " last"]
    last_happened: Bool[Array, "last events"]

    @classmethod
    def empty(cls, size: int, n_events: int) -> "EventHistory":
        """A history with room for `size` events, of `n_events` that there are."""
        first = jnp.full(size, jnp.inf), jnp.full(size, -1), jnp.asarray(0)
        return cls(*first, jnp.full(LAST, jnp.inf), jnp.zeros((LAST, n_events), bool))

    def noted(self, when: Numbers, happened: Array, is_listed: np.ndarray) -> "EventHistory":
        """The history with the events that have happened at one moment."""
        if not happened.size:
            return self
        fired = happened & is_listed
        # Masks rather than scattered writes, with which XLA on CPU does not compile the loop of steps as one function.
        places = self.count + jnp.cumsum(fired) - 1
        mask = (jnp.arange(len(self.times))[:, None] == places) & fired
        is_new, numbers = jnp.any(mask, axis=1), jnp.sum(mask * jnp.arange(len(fired)), axis=1)
        return EventHistory(
            jnp.where(is_new, when, self.times),
            jnp.where(is_new, numbers, self.numbers),
            self.count + jnp.sum(fired),
            *self._with_last(jax.lax.stop_gradient(when), happened),
        )

    def emptied(self, size: int) -> "EventHistory":
        """A history with room for `size` events that knows the last moments."""
        new = EventHistory.empty(size, self.last_happened.shape[1])
        return eqx.tree_at(lambda h: (h.last_times, h.last_happened), new, (self.last_times, self.last_happened))

    def followed_by(self, instant: "EventHistory", most: int) -> "EventHistory":
        """The history with the events of another instant, up to `most`: behind these there is room for an instant."""
        place = jnp.minimum(self.count, most)
        return EventHistory(
            jax.lax.dynamic_update_slice(self.times, instant.times, (place,)),
            jax.lax.dynamic_update_slice(self.numbers, instant.numbers, (place,)),
            self.count + instant.count,
            instant.last_times,
            instant.last_happened,
        )

    def trimmed(self, most: int) -> "EventHistory":
        """The first events, as many as are wanted."""
        return eqx.tree_at(lambda h: (h.times, h.numbers), self, (self.times[:most], self.numbers[:most]))

    def _with_last(self, when: Numbers, happened: Array) -> tuple[Array, Array]:
        is_any = jnp.any(happened)
        times = jnp.concatenate([self.last_times[1:], jnp.reshape(when, 1)])
        last = jnp.concatenate([self.last_happened[1:], happened[None]])
        return jnp.where(is_any, times, self.last_times), jnp.where(is_any, last, self.last_happened)
