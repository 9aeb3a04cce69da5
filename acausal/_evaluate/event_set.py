"""The events of a model as functions of its leaves: conditions, times and changes."""

import dataclasses
import functools as ft
import itertools
import math
from collections.abc import Sequence
from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .._indices import unsigned
from .._jax_private import ClosedJaxpr, jaxpr_as_fun
from .._numbers import Numbers
from .._reduce.event_indicators import NEVER, Circuit, Expression, circuit
from .._reduce.flat_model import indexed
from .._reduce.jaxpr_instants import Instants

EventKind = Literal["when", "at", "sample", "refuse", "impact", "yields", "hold", "follow", "started", "remember"]


@dataclasses.dataclass(frozen=True)
class EventEntry:
    """One event of a component, or of all members of an array of them; `targets` are the leaves that it changes,
    `history` is the leaf that holds the history of a `remember`, and `force` that of the force of an `impact`.
    """

    path: str
    name: str
    kind: EventKind
    stack: tuple[int, ...]
    targets: tuple[int, ...]
    reason: str = ""  # of a `refuse`
    repeats: bool = False  # whether it is periodic
    history: int | None = None
    force: int | None = None

    @property
    def count(self) -> int:
        return math.prod(self.stack)

    @property
    def is_internal(self) -> bool:
        """Whether its name begins with an underscore."""
        return self.name.startswith("_")

    @property
    def is_listed(self) -> bool:
        """Whether the log of a run lists it."""
        return self.kind in ("when", "at", "sample", "refuse", "impact") and not self.is_internal

    @property
    def is_logged(self) -> bool:
        """Whether it is a row of the log, as listed events are, except periodic ones."""
        return self.is_listed and not self.repeats

    @property
    def is_scheduled(self) -> bool:
        """Whether its times are known in advance."""
        return self.kind in ("at", "sample", "remember")

    @property
    def has_condition(self) -> bool:
        return self.kind in ("when", "refuse", "impact", "hold")

    def label(self, index: int) -> str:
        """The path of the event of one member."""
        path = indexed(self.path, self.stack[: self.path.count("[]")], index)
        if self.kind == "hold":
            return f"an ifelse of {path or 'the model'}"
        return f"{path}.{self.name}" if path else self.name


class Schedule(NamedTuple):
    """Scheduled entries that are all periodic, or all single: the position of each among all scheduled ones, its number
    of members, and the numbers of their events.
    """

    repeats: bool
    entries: list[tuple[int, int]]
    numbers: np.ndarray


@dataclasses.dataclass(frozen=True, eq=False)
class Function:
    """A function of some leaves of a model, identified by number."""

    closed: ClosedJaxpr
    leaves: tuple[int, ...]

    def __call__(self, values: Sequence[Numbers]) -> list[jax.Array]:
        return list(jaxpr_as_fun(self.closed)(*values))


@dataclasses.dataclass(frozen=True, eq=False)
class EventSet:
    """The events of a model: entries in sequence, each with its members.

    - `indicators`: for each relation in the conditions of the entries, a number that is positive if it is true.
      `sizes`: magnitudes of the terms of the difference. `of_equals`: the sign of each indicator for equal sides, or 0.
    - `logic`: the condition of each event as an expression of relations; None for events without a condition.
    - `times`: the time or times of each scheduled entry, and its period, infinite for a single event.
    - `actions`: the new values, one array for each target of each entry.
    - `contacts`: for each `impact`, whether it is closed, its separation speed and the least one after an impact.
      `accelerations`: the rate of each of these speeds.
    - `signals` and `delays`: the recorded signal and the delay of each `remember`.
    - `instants`: the instants at which conditions on time alone change, from the leaves `read_by_instants`.
    """

    entries: tuple[EventEntry, ...]
    indicators: Function
    sizes: Function
    of_equals: np.ndarray
    logic: tuple[Expression | None, ...]
    times: Function
    actions: Function
    contacts: Function
    accelerations: Function
    signals: Function
    delays: Function
    instants: Instants | None
    read_by_instants: tuple[int, ...]

    @property
    def total(self) -> int:
        return len(self.members)

    @ft.cached_property
    def members(self) -> list[EventEntry]:
        """The entry of each event."""
        return [entry for entry in self.entries for _ in range(entry.count)]

    @ft.cached_property
    def numbered(self) -> list[tuple[int, EventEntry]]:
        """The entries, each with the number of its first event."""
        firsts = itertools.accumulate((entry.count for entry in self.entries), initial=0)
        return list(zip(firsts, self.entries, strict=False))

    @ft.cached_property
    def labels(self) -> list[str]:
        return [entry.label(index) for entry in self.entries for index in range(entry.count)]

    def refusal(self, number: int) -> str:
        """The reason of a `refuse`."""
        return f"{self.labels[number]}: {self.members[number].reason}"

    @ft.cached_property
    def schedules(self) -> list[Schedule]:
        """The scheduled entries: single ones, then periodic ones."""
        pairs = [(n, entry) for n, entry in self.numbered if entry.is_scheduled]
        found = []
        for repeats in (False, True):
            own = [(i, n, entry.count) for i, (n, entry) in enumerate(pairs) if entry.repeats == repeats]
            if own:
                numbers = np.concatenate([n + np.arange(count) for _, n, count in own])
                found.append(Schedule(repeats, [(i, count) for i, _, count in own], unsigned(numbers)))
        return found

    @ft.cached_property
    def _circuit(self) -> Circuit:
        return circuit([expression or NEVER for expression in self.logic], self.n_relations)

    def hold(self, values: Sequence[Numbers]) -> list[jax.Array]:
        """The truths of the conditions for these values of all leaves, one array for each entry; false without one."""
        indicators = [jnp.ravel(each) for each in self.indicators([values[i] for i in self.indicators.leaves])]
        truths = self._circuit.hold(jnp.concatenate([jnp.zeros(0), *indicators]) > 0)
        return [jnp.reshape(truths[n : n + entry.count], entry.stack) for n, entry in self.numbered]

    def truths_of(self, values: Sequence[Numbers]) -> dict[int, jax.Array]:
        """The truths of `ifelse` for these values of the model's own leaves, by leaf."""
        held = [entry for entry in self.entries if entry.kind == "hold"]
        found = {entry.targets[0]: jnp.zeros(entry.stack) for entry in held}
        # A condition may read the result of another `ifelse`.
        for _ in range(1 + max((int(entry.name.removeprefix("_held")) for entry in held), default=0)):
            truths = self.hold([*values, *found.values()])
            found = {
                entry.targets[0]: truth.astype(float)
                for entry, truth in zip(self.entries, truths, strict=True)
                if entry.kind == "hold"
            }
        return found

    @property
    def remembered(self) -> list[EventEntry]:
        """The entries that keep histories."""
        return [entry for entry in self.entries if entry.kind == "remember"]

    @property
    def history_names(self) -> list[str]:
        """The names of the histories."""
        return [entry.label(i) for entry in self.remembered for i in range(entry.count)]

    @property
    def n_relations(self) -> int:
        return sum(math.prod(aval.shape) for aval in self.indicators.closed.out_avals)

    @ft.cached_property
    def leaves(self) -> frozenset[int]:
        """All leaves that are read."""
        functions = (self.indicators, self.sizes, self.times, self.actions, self.contacts, self.accelerations)
        functions += (self.signals, self.delays)
        return frozenset(self.read_by_instants).union(*(function.leaves for function in functions))
