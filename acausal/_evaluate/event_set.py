"""The events of a model as functions of its leaves: when they happen, and what they change."""

import dataclasses
import functools as ft
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

    def label(self, index: int) -> str:
        """The path of one member's event."""
        path = indexed(self.path, self.stack[: self.path.count("[]")], index)
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
        return sum(entry.count for entry in self.entries)

    @ft.cached_property
    def labels(self) -> list[str]:
        return [entry.label(index) for entry in self.entries for index in range(entry.count)]

    def mask(self, kind: EventKind) -> np.ndarray:
        """Which of the events are of one kind."""
        return np.repeat([entry.kind == kind for entry in self.entries], [entry.count for entry in self.entries])

    @ft.cached_property
    def schedules(self) -> list[Schedule]:
        """The scheduled entries: those that happen once, then those that repeat."""
        firsts = np.cumsum([0, *(entry.count for entry in self.entries)]).tolist()
        pairs = [(n, entry) for n, entry in zip(firsts, self.entries, strict=False) if entry.kind == "at"]
        found = []
        for repeats in (False, True):
            own = [(i, n, entry.count) for i, (n, entry) in enumerate(pairs) if entry.repeats == repeats]
            if own:
                numbers = np.concatenate([n + np.arange(count) for _, n, count in own])
                found.append(Schedule(repeats, [(i, count) for i, _, count in own], unsigned(numbers)))
        return found

    @ft.cached_property
    def is_internal(self) -> np.ndarray:
        """Which of them concern their component alone, since their names begin with an underscore."""
        return np.repeat([e.name.startswith("_") for e in self.entries], [e.count for e in self.entries])

    @ft.cached_property
    def acts(self) -> np.ndarray:
        """Which of the events change something."""
        return np.repeat([bool(entry.targets) for entry in self.entries], [entry.count for entry in self.entries])

    @ft.cached_property
    def reasons(self) -> dict[str, str]:
        """What is said where a refused condition comes true, by the label of its event."""
        return {entry.label(index): entry.reason for entry in self.entries for index in range(entry.count)}

    @ft.cached_property
    def _circuit(self) -> Circuit:
        return circuit([expression or NEVER for expression in self.logic], self.n_relations)

    def hold(self, values: Sequence[Numbers]) -> list[jax.Array]:
        """Which conditions hold for these values of all leaves, one array for each entry; none that is scheduled."""
        margins = [jnp.ravel(margin) for margin in self.margins([values[i] for i in self.margins.leaves])]
        sign = jnp.where(jnp.concatenate([jnp.zeros(0), *margins]) > 0, 1.0, -1.0)
        truths = self._circuit(sign, -sign) > 0
        ends = np.cumsum([entry.count for entry in self.entries]).tolist()
        return [jnp.reshape(truths[end - e.count : end], e.stack) for e, end in zip(self.entries, ends, strict=True)]

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
