"""The start of a run, before integration: past events and the events that they trigger."""

import dataclasses
import functools as ft
from typing import NamedTuple

import diffrax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._declare.history import Past
from ..._equinox_private import while_loop
from ..._evaluate.starts import Inputs
from ..._evaluate.system import System
from ..events.event_history import EventHistory
from ..events.event_time import Approach
from ..events.iteration import CONTRADICTED, REFUSED, STOPPED, settle
from ..events.run_events import RunEvents
from ..setup.field import RunArgs
from ..setup.result import Result, sentence
from ..setup.settings import RunNumbers, Settings
from ..setup.state_vector import Vector
from ..solvers import Rodas5P
from .histories import Histories
from .peaks import Peaks


class LoopStart(NamedTuple):
    """The start of a run: its time, the vector after the events there, the relations and conditions that hold, the due
    times of scheduled events, the event history, and the reason why the run ends there (0 if it continues).
    """

    t: Array
    y: Vector
    truths: Array
    holds: Array
    due: Array
    history: EventHistory | None
    outcome: Array


def loop_start(settings: Settings, args: RunArgs, y0: Array, events: RunEvents | None) -> tuple[RunArgs, LoopStart]:
    """The numbers of the run, completed by its time resolution and hysteresis, and its start from the states `y0`."""
    system, layout, numbers = settings.system, settings.layout, args.numbers
    values = args.inputs.params.leaves
    # The truths that `ifelse` holds are set by the events at the start.
    n_own = len(system.flat.own_leaves)
    numbered = [(leaf < n_own, jnp.ravel(jnp.asarray(values[leaf], float))) for leaf in system.carried.discrete_places]
    discrete = [value if is_own else jnp.zeros(value.shape) for is_own, value in numbered]
    guess = system.starts.values(args.inputs, system.carried.memory)
    y = jnp.concatenate([y0, guess, *discrete, jnp.zeros(layout.size - layout.discrete.stop)])
    if events is None:
        y = _with_peaks(settings, args, _remembered(settings, args, y))
        nothing = jnp.zeros(0, bool)
        return args, LoopStart(
            jnp.asarray(numbers.t0, float), y, nothing, nothing, jnp.zeros(0), None, jnp.asarray(0.0)
        )
    t0 = numbers.t0
    args = dataclasses.replace(args, counted_from=events.counted_from(t0, y, args))
    band, back = events.bands(args)
    args = dataclasses.replace(args, band=band, back=back)
    past = events.past(t0, y, args)
    history = EventHistory.empty(events.room, events.n_model)
    none = jnp.zeros(events.total, bool)
    begins = none if settings.is_initialised else jnp.isfinite(past)
    if settings.is_resumed:
        begins &= past >= t0 - args.tick(t0)
    if numbers.past is not None:
        begins &= past > numbers.past.time + args.tick(numbers.past.time)
    # Clocks tick after the event `started`, which a start search leaves to the run.
    ticks = events.clocks & jnp.isfinite(past) & (past >= t0 - args.tick(t0))
    if settings.is_search:
        begins &= ~(ticks & events.has_start)
    begins |= events.starts | (ticks & np.any(events.starts))
    approach = Approach(t0, jnp.zeros(events.total))  # there is no previous step
    truths, due = jnp.zeros(events.n_indicators, bool), jnp.zeros(events.total)
    settled = settle(events, t0, approach, y, begins, truths, none, due, history, args, order=past)
    y = _remembered(settings, args, events.with_algebraic(t0, settled.y, args))
    if np.any(events.remembers) and not settings.is_resumed:
        y = Histories(events, args).at_start(args.forward * t0, y)
    due = events.due(t0, y, args, events.past(t0, y, args))
    y = _with_peaks(settings, args, y)
    history = EventHistory.empty(settings.max_events + events.room, events.n_model)
    loop = ft.partial(while_loop, kind="bounded" if events.is_reversible else "lax")
    history = history.followed_by(settled.history, loop)
    # A run that stops at an instant ends just after it, so that a run that continues it does not repeat its events.
    is_past = (settled.outcome == STOPPED) & jnp.any(begins & (past >= t0 - args.tick(t0)))
    t = jnp.where(is_past, t0 + 2.0 * args.tick(t0), t0)
    return args, LoopStart(t, y, settled.truths, settled.holds, due, history, settled.outcome)


def _remembered(settings: Settings, args: RunArgs, y: Array) -> Array:
    system, layout = settings.system, settings.layout
    if not system.carried.memory:
        return y
    new = system.with_memory(args.numbers.t0, y[layout.point], args.inputs)[layout.memory]
    return layout.with_part(y, layout.memory, new)


def _with_peaks(settings: Settings, args: RunArgs, y: Array) -> Array:
    if settings.peaks is None:
        return y
    t0 = args.forward * args.numbers.t0
    return settings.layout.with_part(y, settings.layout.peaks, Peaks(settings).at_start(t0, y, args))


class EventStart(NamedTuple):
    """The events of a model, the numbers of a run, the stepped vector after the events at the start, the conditions
    that hold there, and the reason why a run would end there (0 if it would continue).
    """

    events: RunEvents
    args: RunArgs
    y: Array
    holds: Array
    outcome: Array

    @property
    def states(self) -> Array:
        return self.y[self.events.layout.states]

    @property
    def discrete(self) -> Array:
        """The discrete variables as a flat vector."""
        return self.y[self.events.layout.discrete]


def event_start(
    system: System,
    t0: Array,
    states: Array,
    inputs: Inputs,
    past: Past | None,
    *,
    is_initialised: bool = False,
    is_search: bool = False,
) -> EventStart:
    """The start of a run, or of a start search, from these states in a model with events. Past events happen unless
    they have already.
    """
    none = diffrax.NoProgressMeter()
    settings = Settings(
        system, None, None, None, None, None, "end", Rodas5P(), None, 1, 1, none, is_initialised, is_search=is_search
    )
    end, one = jnp.asarray(jnp.inf), jnp.asarray(1.0)
    args = RunArgs(inputs, RunNumbers(t0, end, None, None, one, None, [], [], [], [], past=past))
    events = RunEvents(settings, settings.layout, is_reversible=True)
    args, start = loop_start(settings, args, states, events)
    return EventStart(events, args, start.y, start.holds, start.outcome)


def why_ended(system: System, outcome: float, holds: Array) -> str:
    """The reason why a run ends at its start, with the events whose conditions hold there."""
    events = system.events
    assert events is not None
    if outcome == REFUSED:
        refused = [entry.kind == "refuse" for entry in events.members]
        return events.refusal(int(np.argmax(refused & np.asarray(holds)[: events.total])))
    names = [label for label, is_true in zip(events.labels, np.asarray(holds), strict=False) if is_true]
    reason = sentence(Result.bad_reset if outcome == CONTRADICTED else Result.events_endless)
    return f"{reason} The condition of {' and of '.join(names)} holds." if names else reason
