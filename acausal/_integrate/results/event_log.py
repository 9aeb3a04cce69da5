"""Event log of a run."""

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
    """The events of a run in chronological order.

    - `times` in s, differentiable, infinite after the last event. A single solution has only those that occurred.
    - `numbers`: the index of each event in `labels`, -1 after the last one.
    - `count`: the number of events. It can exceed the number of recorded events; see `max_events` of `simulate`.
    """

    times: Array
    numbers: Array
    count: Array
    labels: tuple[str, ...] = eqx.field(static=True)

    @classmethod
    def of(cls, history: EventHistory, labels: Sequence[str], is_listed: np.ndarray, most: int) -> "EventLog":
        """The log of the first `most` listed events in the history of a run."""
        times, numbers = history.listed(is_listed, most)
        return cls(times, numbers, jnp.asarray(history.count), tuple(labels))

    @classmethod
    def empty(cls, batch: tuple[int, ...]) -> "EventLog":
        """The log of runs without events."""
        return cls(jnp.zeros((*batch, 0)), jnp.zeros((*batch, 0), int), jnp.zeros(batch, int), ())

    @property
    def names(self) -> list[str]:
        """The label of each event of a single run: its component and the event."""
        return [self.labels[number] for number in self._known_numbers.tolist() if number >= 0]

    @property
    def _known_numbers(self) -> np.ndarray:
        numbers = known(self.numbers)
        if numbers is None or numbers.ndim > 1:
            raise ModelError("Event names exist only for a single run outside of jit and vmap: use of_event instead.")
        return numbers

    def of_event(self, name: str) -> Array:
        """The times of one event, infinite in the rows of other events.

        Raises `ModelError` if the model has no event of this name.
        """
        if name not in self.labels:
            raise ModelError(f"The model has no event {name!r}.{suggestion(name, self.labels)}")
        return jnp.where(self.numbers == self.labels.index(name), self.times, jnp.inf)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Mark the events of a single run on a time axis, one row for each event; returns the matplotlib axes."""
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
