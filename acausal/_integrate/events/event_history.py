"""Event history of a run."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from ..._equinox_private import written
from ..._numbers import Numbers
from ..._tracing import known


class EventHistory(eqx.Module):
    """Event history of a run, as far as there is room for it.

    - `times`, `happened`: the moments with any event, infinite after the last one, and the events of each moment;
      within transformations of jax, only logged events.
    - `n`: number of moments, including those without room.
    - `count`: number of logged events.
    """

    times: Float[Array | np.ndarray, " room"]
    happened: Bool[Array | np.ndarray, "room events"]
    n: Int[Array | np.ndarray, ""]
    count: Int[Array | np.ndarray, ""]

    @classmethod
    def empty(cls, room: int, n_events: int) -> "EventHistory":
        """An empty history with room for `room` moments, for a model with `n_events` events."""
        none = jnp.asarray(0)
        return cls(jnp.full(room, jnp.inf), jnp.zeros((room, n_events), bool), none, none)

    def noted(self, when: Numbers, happened: Array, is_logged: np.ndarray) -> "EventHistory":
        """The history with the events of one more moment."""
        is_any = jnp.any(happened)
        # A mask instead of a scatter, with which XLA on CPU does not compile the loop of steps as one function.
        is_new = (jnp.arange(len(self.times)) == self.n) & is_any
        return EventHistory(
            jnp.where(is_new, when, self.times),
            jnp.where(is_new[:, None], happened, self.happened),
            self.n + is_any,
            self.count + jnp.sum(happened & is_logged),
        )

    def followed_by(self, instant: "EventHistory", loop: Callable[..., Any]) -> "EventHistory":
        """The history with the moments of an instant, as far as there is room. They are written one by one, so that the
        cost of a step does not depend on the room.
        """
        room, n = self.times.shape[0], jnp.minimum(instant.n, len(instant.times))

        def goes_on(carry: Any) -> Array:
            return (carry[0] < n) & (self.n + carry[0] < room)

        def write(carry: Any) -> Any:
            i, times, happened = carry
            place, true = self.n + i, jnp.asarray(True)
            times, happened = (
                written(rows, new[i], place, true)
                for rows, new in ((times, instant.times), (happened, instant.happened))
            )
            return i + 1, times, happened

        start = (jnp.asarray(0), self.times, self.happened)
        _, times, happened = loop(goes_on, write, start, max_steps=len(instant.times), buffers=lambda carry: carry[1:])
        return EventHistory(times, happened, self.n + n, self.count + instant.count)

    def logged(self, is_logged: np.ndarray, most: int) -> tuple[Array, Array]:
        """The times of the logged events, and their numbers.

        If the history is traced, the arrays have `most` rows, with infinity and -1 after the last event.
        """
        times, happened = known(self.times), known(self.happened)
        if times is not None and happened is not None and times.ndim == 1:
            moments, numbers = np.nonzero(happened & is_logged)
            return jnp.asarray(self.times)[moments], jnp.asarray(numbers)
        if jnp.ndim(self.times) > 1:
            return jax.vmap(lambda history: history.logged(is_logged, most))(self)
        fired = jnp.ravel(self.happened & is_logged)
        # Events without room are written to an extra last row.
        places = jnp.where(fired, jnp.minimum(jnp.cumsum(fired) - 1, most), most)
        numbers = jnp.tile(jnp.arange(len(is_logged)), len(self.times))
        moments = jnp.repeat(self.times, len(is_logged))
        times = jnp.full(most + 1, jnp.inf).at[places].set(jnp.where(fired, moments, jnp.inf))
        return times[:most], jnp.full(most + 1, -1).at[places].set(jnp.where(fired, numbers, -1))[:most]
