"""Periodic events that set variables from other variables: samplers, sampled controllers."""

from typing import NamedTuple

from .._reduce.jaxpr import slice_output
from .event_set import EventEntry
from .system import System


class Sampler(NamedTuple):
    """A periodic event and the variables, by number, from which it computes new values."""

    entry: EventEntry
    read: frozenset[int]

    @property
    def labels(self) -> list[str]:
        """The label of the event of each member."""
        return [self.entry.label(index) for index in range(self.entry.count)]


def samplers(system: System) -> list[Sampler]:
    """The periodic events that set a variable from other variables."""
    events, leaves = system.events, system.flat.leaves
    if events is None:
        return []
    found, first = [], 0
    for entry in events.entries:
        places = range(first, first + len(entry.targets))
        first += len(entry.targets)
        read = {events.actions.leaves[i] for place in places for i in slice_output(events.actions.closed, place).used}
        variables = frozenset(leaf for leaf in read if leaves[leaf].declaration.role in ("var", "flow"))
        if entry.repeats and variables:
            found.append(Sampler(entry, variables))
    return found
