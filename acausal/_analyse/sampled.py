"""What a linear system leaves out of a model that samples."""

import warnings

from .._errors import listed
from .._evaluate.system import System
from .._reduce.jaxpr import slice_output


class SampledWarning(UserWarning):
    """A linear system holds what a model samples."""


def warn_of_samples(system: System) -> None:
    """Warn of events that take over variables again and again: what they set is constant in a linear system, as if the
    loops through it were open.
    """
    labels = sampled(system)
    if labels:
        warnings.warn(
            f"The linear system holds what is sampled as it is at the point, as if the loops through it were open, for "
            f"{listed(labels)}. Remedy: put a continuous controller in place of a sampled one.",
            SampledWarning,
            stacklevel=3,
        )


def sampled(system: System) -> list[str]:
    """The labels of events that repeat and set something by what equations determine."""
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
