"""What happened when in a run."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from .._tracing import is_traced
from .record import Record


class EventLog(eqx.Module):
    """The events of a run in their order.

    - `times` in s, differentiable, infinite after the last event; in a single solution only those that occurred.
    - `numbers`: which event each is, an index into `labels`, -1 after the last one.
    - `count`: how many there were. It can be more than are recorded; see `max_events` of `simulate`.
    """

    times: Any
    numbers: Any
    count: Any
    labels: tuple[str, ...] = eqx.field(static=True)

    @classmethod
    def of(cls, record: Record, labels: Sequence[str]) -> "EventLog":
        """The log of a run's record."""
        times, numbers = record.times, record.numbers
        if not is_traced(times) and jnp.ndim(times) == 1:
            kept = np.asarray(numbers) >= 0
            times, numbers = times[kept], numbers[kept]
        return cls(times, numbers, record.count, tuple(labels))

    @property
    def names(self) -> list[str]:
        """The component and what happened to it, for each event of a single run."""
        return [self.labels[number] for number in np.asarray(self.numbers).tolist() if number >= 0]

    def of_event(self, name: str) -> Any:
        """The times of one event, infinite where it is another one."""
        return jnp.where(self.numbers == self.labels.index(name), self.times, jnp.inf)

    def plot(self, ax: Any = None) -> Any:
        """Mark the events of a single run on a time axis, a row for each; returns the matplotlib axes."""
        from .._show.plot import plot_events

        return plot_events(np.asarray(self.times), self.names, ax)

    def __len__(self) -> int:
        return int(np.sum(np.asarray(self.numbers) >= 0))

    def __str__(self) -> str:
        lines = [f"{'time [s]':>14}  event"]
        lines += [f"{time:14.9g}  {name}" for time, name in zip(np.asarray(self.times), self.names, strict=False)]
        missing = int(self.count) - len(self)
        return "\n".join(
            lines + ([f"and {missing} more; simulate(..., max_events=...) records more"] if missing else [])
        )
