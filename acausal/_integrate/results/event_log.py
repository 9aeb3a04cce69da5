"""What happened when in a run."""

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._errors import ModelError, suggestion
from ..._extras import Axes, given_or_new
from ..._tracing import known
from ..events.event_history import EventHistory


class EventLog(eqx.Module):
    """The events of a run in their order.

    - `times` in s, differentiable, infinite after the last event; in a single solution only those that occurred.
    - `numbers`: which event each is, an index into `labels`, -1 after the last one.
    - `count`: how many there were. It can be more than are recorded; see `max_events` of `simulate`.
    """

    times: Array
    numbers: Array
    count: Array
    labels: tuple[str, ...] = eqx.field(static=True)

    @classmethod
    def of(cls, history: EventHistory, labels: Sequence[str], is_listed: np.ndarray, most: int) -> "EventLog":
        """The log of a run's history, of the first `most` events that are listed."""
        times, numbers = history.listed(is_listed, most)
        return cls(times, numbers, jnp.asarray(history.count), tuple(labels))

    @classmethod
    def empty(cls, batch: tuple[int, ...]) -> "EventLog":
        """The log of runs in which nothing can happen."""
        return cls(jnp.zeros((*batch, 0)), jnp.zeros((*batch, 0), int), jnp.zeros(batch, int), ())

    @property
    def names(self) -> list[str]:
        """The component and what happened to it, for each event of a single run."""
        return [self.labels[number] for number in self._known_numbers.tolist() if number >= 0]

    @property
    def _known_numbers(self) -> np.ndarray:
        numbers = known(self.numbers)
        if numbers is None or numbers.ndim > 1:
            raise ModelError("The names of events are those of a single run, outside of jit and vmap: use of_event.")
        return numbers

    def of_event(self, name: str) -> Array:
        """The times of one event, infinite where it is another one.

        Raises `ModelError` for a name that no event of the model has.
        """
        if name not in self.labels:
            raise ModelError(f"The model has no event {name!r}.{suggestion(name, self.labels)}")
        return jnp.where(self.numbers == self.labels.index(name), self.times, jnp.inf)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Mark the events of a single run on a time axis, a row for each; returns the matplotlib axes."""
        times, names = np.asarray(self.times), self.names
        rows = list(dict.fromkeys(names))
        ax = given_or_new(ax, 7.0, 1.0 + 0.3 * len(rows))
        for i, row in enumerate(rows):
            marks = times[np.array(names) == row]
            ax.plot(marks, np.full(len(marks), i), "|", markersize=12, color="black")
        ax.set_yticks(range(len(rows)), rows)
        ax.set_ylim(max(len(rows), 1) - 0.5, -0.5)
        ax.set_xlabel("time [s]")
        ax.grid(alpha=0.3)
        return ax

    def __len__(self) -> int:
        return int(np.sum(self._known_numbers >= 0))

    def __str__(self) -> str:
        lines = [f"{'time [s]':>14}  event"]
        times = np.asarray(known(self.times))
        lines += [f"{time:14.9g}  {name}" for time, name in zip(times, self.names, strict=False)]
        missing = int(known(self.count) or 0) - len(self)
        return "\n".join(
            lines + ([f"and {missing} more; simulate(..., max_events=...) records more"] if missing else [])
        )
