"""Warnings about sampled variables, which a linear system holds constant."""

import warnings

from .._errors import listed
from .._evaluate.system import System
from .._reduce.jaxpr import slice_output


class SampledWarning(UserWarning):
    """A linear system holds the sampled variables of a model constant."""


def warn_of_samples(system: System) -> None:
    """Warn of periodic events that set variables: a linear system holds these constant, as if the loops through them
    were open.
    """
    labels = sampled(system)
    if labels:
        warnings.warn(
            f"The linear system holds sampled variables constant, as if the loops through them were open, for "
            f"{listed(labels)}. Remedy: replace a sampled controller by a continuous one.",
            SampledWarning,
            stacklevel=3,
        )


def sampled(system: System) -> list[str]:
    """The labels of periodic events that set a variable from other variables."""
    events, leaves = system.events, system.flat.leaves
    if events is None:
        return []
    found, first = [], 0
    for entry in events.entries:
        places = range(first, first + len(entry.targets))
        first += len(entry.targets)
        read = {events.actions.leaves[i] for place in places for i in slice_output(events.actions.closed, place).used}
        if entry.repeats and any(leaves[leaf].declaration.role in ("var", "flow") for leaf in read):
            found += [entry.label(index) for index in range(entry.count)]
    return found
