"""Event log of a run."""

import dataclasses
from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._errors import ModelError, suggestion
from ..._evaluate.event_set import EventSet
from ..._extras import Axes, given_or_new
from ..._tracing import known
from ..events.event_history import EventHistory

_LINES = 32  # maximum number of events in a printed log


@dataclasses.dataclass(frozen=True)
class Ticks:
    """The number of times that a periodic event happened, and the first and last of them in s."""

    label: str
    count: int
    first: float
    last: float


class EventLog(eqx.Module):
    """The events of a run in chronological order, without periodic ones.

    - `times` in s, differentiable. A run outside of `jit`, `vmap` and `grad` has all its events. Inside, the log has
      `max_events` rows, infinite after the last event.
    - `numbers`: the index of each event in `labels`, -1 after the last one.
    - `count`: the number of events. Inside `jit`, it can exceed the number of recorded events.
    - `ticks`: the periodic events of a run outside of `jit`, such as samples: label, count, first and last time.
    """

    times: Array
    numbers: Array
    count: Array
    labels: tuple[str, ...] = eqx.field(static=True)
    ticks: tuple[Ticks, ...] = eqx.field(static=True, default=())

    @classmethod
    def from_history(cls, history: EventHistory, events: EventSet, most: int) -> "EventLog":
        """The log of the events in the history of a run; the first `most` of them if it is traced."""
        is_logged = np.array([entry.is_logged for entry in events.members], bool)
        times, numbers = history.logged(is_logged, most)
        is_tick = np.array([entry.is_listed and entry.repeats for entry in events.members], bool)
        labels = tuple(events.labels)
        return cls(times, numbers, jnp.asarray(history.count), labels, _ticks(history, labels, is_tick))

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

    def of(self, *names: str) -> "EventLog":
        """The log of some events of a single run: those of parts, such as "brake", or of a kind, such as "stick"."""
        for name in names:
            if not any(_is_of(label, name) for label in self.labels):
                known_names = {piece for label in self.labels for piece in _names_of(label)}
                raise ModelError(f"No part of the model and no kind is named {name!r}.{suggestion(name, known_names)}")
        chosen = np.array([any(_is_of(label, name) for name in names) for label in self.labels], bool)
        numbers = self._known_numbers
        rows = np.flatnonzero((numbers >= 0) & chosen[numbers])
        ticks = tuple(tick for tick in self.ticks if any(_is_of(tick.label, name) for name in names))
        return EventLog(self.times[rows], self.numbers[rows], jnp.asarray(len(rows)), self.labels, ticks)

    def of_event(self, name: str) -> Array:
        """The times of one event, infinite in the rows of other events.

        Raises `ModelError` if the model has no event of this name, or if it is periodic.
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
        times = np.asarray(known(self.times))[:_LINES]
        lines += [f"{time:14.9g}  {name}" for time, name in zip(times, self.names[:_LINES], strict=False)]
        if (hidden := len(self) - _LINES) > 0:
            lines.append(f"and {hidden} more; select some by part or kind with .of('part', 'kind')")
        if (missing := int(known(self.count) or 0) - len(self)) > 0:
            lines.append(f"and {missing} more; simulate(..., max_events=...) records more")
        lines += [
            f"{item.label} {item.count} times, from {item.first:.6g} s to {item.last:.6g} s" for item in self.ticks
        ]
        return "\n".join(lines)


def _ticks(history: EventHistory, labels: Sequence[str], is_tick: np.ndarray) -> tuple[Ticks, ...]:
    """The periodic events of a known history of a single run."""
    times, happened = known(history.times), known(history.happened)
    if times is None or happened is None or times.ndim > 1:
        return ()
    found = []
    for number in np.flatnonzero(is_tick & np.any(happened, axis=0)).tolist():
        own = times[happened[:, number]]
        found.append(Ticks(labels[number], len(own), float(own[0]), float(own[-1])))
    return tuple(found)


def _names_of(label: str) -> set[str]:
    """The path of an event, those of the parts that contain it, and its kind."""
    pieces = label.split(".")
    return {".".join(pieces[:i]) for i in range(1, len(pieces) + 1)} | {pieces[-1]}


def _is_of(label: str, name: str) -> bool:
    return name in _names_of(label) or label.startswith(f"{name}[")
