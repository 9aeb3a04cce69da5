"""What is at the start of a run, before anything is integrated: past events, and what they lead to."""

from typing import NamedTuple

import diffrax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._declare.past import Past
from .._evaluate.event_set import EventSet
from .._evaluate.starts import Inputs
from .._evaluate.system import System
from .adjoint import BothModes
from .field import Given
from .result import Result, sentence
from .run_events import RunEvents
from .settings import RunNumbers, Settings
from .settle import CONTRADICTED, REFUSED
from .solvers import Rodas5P
from .stepping import begin_run


class Start(NamedTuple):
    """The events of a model, the stepped vector after those at the start, and the conditions that hold there."""

    events: RunEvents
    given: Given
    y: Array
    holds: Array

    @property
    def states(self) -> Array:
        return self.y[self.events.layout.states]

    @property
    def discrete(self) -> Array:
        """The discrete variables, one after the other."""
        return self.y[self.events.layout.discrete]

    @property
    def outcome(self) -> Array:
        """0, or why a run ends at its start."""
        return self.y[self.events.layout.outcome]


def start_of(
    system: System,
    t0: Array,
    states: Array,
    inputs: Inputs,
    past: Past | None,
    *,
    is_started: bool = False,
    is_search: bool = False,
) -> Start:
    """What happens at the start of a run from these states, in a model with events, or of a search from there; past
    events happen unless they have already.
    """
    none = diffrax.NoProgressMeter()
    settings = Settings(
        system, None, None, None, None, None, "end", Rodas5P(), BothModes(), 1, 1, none, is_started, is_search=is_search
    )
    end, one = jnp.asarray(jnp.inf), jnp.asarray(1.0)
    given = Given(inputs, RunNumbers(t0, end, None, None, one, None, [], [], [], [], past=past))
    given, y, events, memory = begin_run(settings, given, states)
    assert events is not None
    assert memory is not None
    return Start(events, given, y, memory.holds)


def why_ended(system: System, outcome: float, holds: Array) -> str:
    """What to say of a run that ends at its start."""
    events = system.events
    assert events is not None
    if outcome == REFUSED:
        return refusal(events, np.asarray(holds)[: events.total] & events.mask("refuse"))
    return sentence(Result.bad_reset if outcome == CONTRADICTED else Result.events_endless)


def refusal(events: EventSet, refused: Array | np.ndarray) -> str:
    """The reason that the first component gives which refuses the point."""
    label = events.labels[int(np.argmax(refused))]
    return f"{label}: {events.reasons[label]}"
