"""The rounds of an event iteration."""

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._equinox_private import while_loop
from ..._numbers import Numbers
from ..._reduce.event_indicators import edges
from ..setup.field import RunArgs
from .changes import changed, with_follows, with_impulses
from .event_history import EventHistory
from .event_time import Approach, carried_to_moment
from .run_events import RunEvents

TOGETHER = 10  # rounds in which all conditions that have become true act together; in later rounds, one at a time


class Counted(Protocol):
    """A round with its number."""

    @property
    def count(self) -> Array: ...


R = TypeVar("R", bound=Counted)


def most_rounds(events: RunEvents) -> int:
    """Limit on the number of rounds: those with all events together, those with one event at a time, and one for each
    variable that follows a value, because such variables may change one after the other.
    """
    number, _, is_own = events.writes
    return TOGETHER + 4 * events.total + 16 + int(np.sum(is_own & events.follows[number]))


def ready(events: RunEvents, triggered: Array) -> Array:
    """The triggered events that happen in a round. Conditions of `ifelse` change first, because values that depend on
    them, which other events read, are not final before.
    """
    return triggered & (events.held | ~jnp.any(triggered & events.held))


def first_of(events: RunEvents, triggered: Array) -> Array:
    """The first of the triggered events in the list, and each `follow` among them."""
    others = triggered & ~events.follows
    return (triggered & events.follows) | (others & (jnp.cumsum(others) == 1))


def without_value(t: Array) -> Array:
    """Zero, with the derivatives of t."""
    return t - jax.lax.stop_gradient(t)


def repeated(goes_on: Callable[[R], Any], next_round: Callable[[R], R], start: R, most: int, is_reversible: bool) -> R:
    """Repeats `next_round` while `goes_on`, at most `most` times; `is_reversible` supports reverse mode."""
    if is_reversible:
        return while_loop(goes_on, next_round, start, max_steps=most, kind="bounded", base=16)
    return jax.lax.while_loop(lambda r: goes_on(r) & (r.count < most), next_round, start)


class Round(NamedTuple):
    """One round; `ys` holds the stepped vector that events read, and the vector after the events so far."""

    t: Array
    ys: Array
    due: Array  # events that are due and have not happened yet
    ticks: Array  # events that wait for all others: `started`, those rescheduled to this instant, and its clocks
    truths: Array
    holds: Array
    by_time: Array  # events that time alone triggers in a round with a due one; each of them has its own moment
    happened: Array
    first: Array  # the first event that happened, -1 if none
    stored: Array  # stored energy before the events
    lost: Array
    order: Array  # at the start of a run, the last time of each past event
    n_own: Array  # number of rounds with due events
    history: EventHistory
    before: Array  # the moment of the first listed event and the vector just before it; may be empty
    signals: Array  # recorded signals after the events so far
    moved: Array  # the sum of their jumps, each times the derivatives of its time
    is_bad: Array
    goes_on: Array
    count: Any


class Own(NamedTuple):
    """The due event of a round, if any: the first in the list among those of one instant, which ends at `now`."""

    number: Array
    mask: Array
    is_any: Array
    now: Numbers


class Iteration(NamedTuple):
    """Data shared by all rounds of an instant; see `settle`."""

    events: RunEvents
    approach: Approach
    due: Array
    args: RunArgs
    is_start: bool
    truths: Array  # of the relations before the instant

    def next_round(self, r: Round) -> Round:
        events, args = self.events, self.args
        own = self.own(r)
        t, ys = r.t, r.ys
        if not self.is_start:
            # Due events read the vector after the last round without one, if any, otherwise that before the instant.
            happened = jnp.stack([r.happened & (r.count > r.n_own), r.happened])
            moment, there = carried_to_moment(events, own.number, t, self.approach, ys, self.due, happened, args)
            t, ys = jnp.where(own.is_any, moment, t), jnp.where(own.is_any, there, ys)
        here = events.here(t, jnp.where(own.is_any, ys[0], ys[1]), args, is_start=self.is_start)
        is_first = ~own.is_any & (r.count == r.n_own)
        changed_here = (r.truths != self.truths) & (not self.is_start)
        renewed = events.renewed(t, r.truths, changed_here, here.indicators, args)
        # Before the events of an instant, only time has passed.
        truths = jnp.where(own.is_any & ~events.of_time_alone, r.truths, renewed)
        if self.is_start:
            truths = jnp.where(is_first, events.truths_at_start(t, here.indicators, args), truths)
        true = events.circuit.hold(truths)
        held, listed, remains = self.before(r, true, is_first)
        changes = edges(true, held, events.either)
        triggered = with_follows(events, changes, ys[1], here.values)
        triggered &= ~events.nonlinear & ~events.waits
        n_together = TOGETHER + jnp.maximum(jnp.sum(r.happened), r.n_own)
        together = ready(events, triggered) | (triggered & r.by_time)
        chosen = jnp.where(r.count < n_together, together, first_of(events, triggered))
        begins = chosen & r.by_time & ~own.is_any
        # Events that time alone triggers happen together with the due ones, before all consequences.
        fired = jnp.where(own.is_any, own.mask & ~events.impacts, chosen & ~jnp.any(begins))
        keeps = own.is_any | (jnp.any(begins) & jnp.any(r.happened & events.acts))
        if self.is_start and events.settings.stop and events.settings.direction is not False:
            # At the start, a stop condition that is exactly zero is met; later it is met when it changes sign.
            fired |= events.stops & (here.indicators[-1] == 0) & is_first
        acts = fired & events.acts
        any_acts = jnp.any(acts)
        setting = fired
        if not self.is_start:
            # Due events happen at the left limit, which every `follow` takes over: it may change between events.
            setting = fired | (own.is_any & events.follows)
        new, is_bad = changed(events, t, ys[1], here.values, setting, remains, args)
        new = with_impulses(events, t, ys[1], new, here, fired, args)
        y = jnp.where(any_acts | jnp.any(setting), new, ys[1])
        follows = fired | begins
        holds = jnp.where(own.is_any, held, true & (held | follows))
        holds = jnp.where(events.either & ~own.is_any, jnp.where(follows | events.nonlinear, true, held), holds)
        due, ticks, base, order = self.following(r._replace(due=r.due | begins), own, keeps, t, ys, y, jnp.any(fired))
        stored = jnp.where(r.count == 0, here.stored, r.stored)
        # Conditions that an earlier round has changed follow from its events, not from time.
        by_time = jnp.zeros_like(changes)
        if not self.is_start:
            by_time = own.is_any & changes & (true != events.circuit.hold(r.truths)) & ~events.impacts
        happened = ((fired | listed) & ~events.follows)[: events.n_model]
        is_first_listed = jnp.any(happened & events.is_listed[: events.n_model]) & jnp.all(jnp.isinf(r.before[:1]))
        is_logged = events.is_logged[: events.n_model]
        # If the room for the history is limited, only logged events use it.
        happened = happened if events.settings.save == "chunk" else happened & is_logged
        history = r.history.noted(t, happened, is_logged)
        signals = r.signals
        if not self.is_start:
            signals = events.signals_between(self.approach.before, t, y, args, r.happened | fired)
        return Round(
            t=t,
            ys=jnp.stack([base, y]),
            due=due,
            ticks=ticks,
            truths=jnp.where(own.is_any, r.truths, truths),
            holds=holds,
            by_time=by_time,
            happened=r.happened | fired,
            first=jnp.where((r.first < 0) & any_acts, jnp.argmax(acts), r.first),
            stored=stored,
            lost=jnp.where(own.is_any, r.lost, stored - here.stored),
            order=order,
            n_own=r.n_own + own.is_any,
            history=history,
            before=jnp.where(is_first_listed, jnp.append(t, ys[0])[: len(r.before)], r.before),
            signals=signals,
            moved=r.moved + (signals - r.signals) * without_value(t),
            is_bad=r.is_bad | (is_bad & any_acts),
            goes_on=(own.is_any | jnp.any(fired) | jnp.any(due)) & ~jnp.any(fired & events.refused),
            count=r.count + 1,
        )

    def own(self, r: Round) -> Own:
        # At the start only scheduled events can be due. Without any, their code is not compiled.
        total, is_any = self.events.total, jnp.asarray(False)
        if not self.is_start or self.events.schedules or np.any(self.events.starts):
            is_any = jnp.any(r.due)
        order = r.order if self.is_start else jnp.zeros(total)
        earliest = jnp.min(jnp.where(r.due, order, jnp.inf))
        now = earliest + self.args.tick(earliest)
        number = jnp.argmax(r.due & (order <= now))
        return Own(number, (jnp.arange(total) == number) & is_any, is_any, now)

    def before(self, r: Round, true: Array, is_first: Array) -> tuple[Array, Array, Array]:
        """The conditions that held before a round; the events that are only listed; and those whose discrete variables
        are already set.

        At the start, an event that the start search has executed is listed, but does not happen again. That search sets
        discrete variables only; the event's other variables are set here.
        """
        events, args, none = self.events, self.args, jnp.zeros(self.events.total, bool)
        if not self.is_start:
            return r.holds, none, none
        done = true & events.done(args)
        had, remains = done & (r.count == 0), done & events.remains & is_first
        lists_past = events.settings.is_initialised and args.numbers.past is None
        listed = (had | jnp.isfinite(r.order)) & (r.count == 0) & lists_past
        held = jnp.where((events.stops | events.nonlinear) & is_first, true, r.holds | had & ~events.remains)
        return held, listed, remains

    def following(
        self, r: Round, own: Own, keeps: Array, t: Numbers, ys: Array, y: Array, any_fired: Array
    ) -> tuple[Array, Array, Array, Array]:
        """The events due after a round with the result y, the waiting events, the vector that the next round reads, and
        the times of past events. Due events go on to read the same vector if the round `keeps` it.
        """
        events, args, clocks = self.events, self.args, self.events.clocks
        due, ticks, base, order = r.due & ~own.mask, r.ticks, ys[0], r.order
        if self.is_start:
            # Past events of one instant read the values before all of them; those of the next instant read the values
            # that these have set.
            is_now = due & (r.order <= own.now)
            # An event is due again only at times that this round has changed.
            is_reset, last = events.set_anew(t, ys[1], y, args)
            is_reset &= ~is_now
            order = jnp.where(is_reset, last, r.order)
            ticks |= is_reset & jnp.isfinite(last) & (last >= t - args.tick(t))
            due = (own.is_any | any_fired) & jnp.isfinite(order) & (due | is_reset) & ~ticks
            base = jnp.where(own.is_any & (jnp.min(jnp.where(due, order, jnp.inf)) > own.now), y, base)
        elif events.resets_times:
            # Events rescheduled to this instant, or to an earlier one, happen now.
            _, last = events.set_anew(t, ys[1], y, args)
            ticks |= jnp.isfinite(last) & (~clocks | (last >= t - args.tick(t)))
        # After all other events, `started` and those rescheduled to this instant happen, and then the clocks tick,
        # which read the current values.
        is_quiet = ~own.is_any & ~any_fired & ~jnp.any(due)
        next_ones = jnp.where(jnp.any(ticks & ~clocks), ticks & ~clocks, ticks) & is_quiet
        return due | next_ones, ticks & ~next_ones, jnp.where(keeps, base, y), order
