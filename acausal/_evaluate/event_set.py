"""The events of a model as functions of its leaves: when they happen, and what they change."""

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
from .._reduce.flat_model import indexed
from .._reduce.instants import Instants
from .._reduce.logic import NEVER, Circuit, Expression, circuit

EventKind = Literal["when", "at", "refuse", "hold"]


@dataclasses.dataclass(frozen=True)
class EventEntry:
    """One event of a component, or of all members of an array of them: `targets` are the leaves that it changes."""

    path: str
    name: str
    kind: EventKind
    stack: tuple[int, ...]
    targets: tuple[int, ...]
    reason: str = ""  # why it is refused
    repeats: bool = False  # whether it happens again and again, in equal intervals

    @property
    def count(self) -> int:
        return math.prod(self.stack)

    @property
    def is_internal(self) -> bool:
        """Whether it concerns its component alone, since its name begins with an underscore."""
        return self.name.startswith("_")

    @property
    def is_listed(self) -> bool:
        """Whether the log of a run lists it."""
        return self.kind != "hold" and not self.is_internal

    def label(self, index: int) -> str:
        """The path of one member's event."""
        path = indexed(self.path, self.stack[: self.path.count("[]")], index)
        if self.kind == "hold":
            return f"an ifelse of {path or 'the model'}"
        return f"{path}.{self.name}" if path else self.name


class Schedule(NamedTuple):
    """Scheduled entries that all repeat, or of which none does: of each its place among all scheduled ones and how many
    members it has; and the numbers of their events.
    """

    repeats: bool
    entries: list[tuple[int, int]]
    numbers: np.ndarray


@dataclasses.dataclass(frozen=True, eq=False)
class Function:
    """A function of some leaves of a model, given by number."""

    closed: ClosedJaxpr
    leaves: tuple[int, ...]

    def __call__(self, values: Sequence[Numbers]) -> list[jax.Array]:
        return list(jaxpr_as_fun(self.closed)(*values))


@dataclasses.dataclass(frozen=True, eq=False)
class EventSet:
    """The events of a model, one entry after the other, each with its members.

    - `margins`: of the relations that the conditions of the entries are made of, numbers that are positive where these
      hold. `sizes`: how large the terms are that a margin is the difference of.
    - `logic`: how the condition of each event is made of relations, None for those that are scheduled.
    - `times`: of each scheduled entry, its time or times, and its period, infinite where it does not repeat.
    - `actions`: the new values, one array for each target of each entry.
    - `instants`: when conditions change that depend on time alone, from the leaves `read_by_instants`.
    """

    entries: tuple[EventEntry, ...]
    margins: Function
    sizes: Function
    logic: tuple[Expression | None, ...]
    times: Function
    actions: Function
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
        """What an event says that must not happen."""
        return f"{self.labels[number]}: {self.members[number].reason}"

    @ft.cached_property
    def schedules(self) -> list[Schedule]:
        """The scheduled entries: those that happen once, then those that repeat."""
        pairs = [(n, entry) for n, entry in self.numbered if entry.kind == "at"]
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
        """Which conditions hold for these values of all leaves, one array for each entry; none that is scheduled."""
        margins = [jnp.ravel(margin) for margin in self.margins([values[i] for i in self.margins.leaves])]
        truths = self._circuit.hold(jnp.concatenate([jnp.zeros(0), *margins]) > 0)
        return [jnp.reshape(truths[n : n + entry.count], entry.stack) for n, entry in self.numbered]

    def truths_of(self, values: Sequence[Numbers]) -> dict[int, jax.Array]:
        """The truths that `ifelse` would hold for these values of the model's own leaves, by leaf."""
        held = [entry for entry in self.entries if entry.kind == "hold"]
        found = {entry.targets[0]: jnp.zeros(entry.stack) for entry in held}
        # A condition may read what another one chooses.
        for _ in range(1 + max((int(entry.name.removeprefix("_held")) for entry in held), default=0)):
            truths = self.hold([*values, *found.values()])
            found = {
                entry.targets[0]: truth.astype(float)
                for entry, truth in zip(self.entries, truths, strict=True)
                if entry.kind == "hold"
            }
        return found

    @property
    def n_relations(self) -> int:
        return sum(math.prod(aval.shape) for aval in self.margins.closed.out_avals)

    @ft.cached_property
    def leaves(self) -> frozenset[int]:
        """All leaves that are read."""
        functions = (self.margins, self.sizes, self.times, self.actions)
        return frozenset(self.read_by_instants).union(*(function.leaves for function in functions))
