"""Event iteration: what happens at one instant, until relations and discrete variables no longer change."""

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol, TypeVar

import jax
import jax.numpy as jnp
from jax import Array

from .._equinox_private import while_loop
from .._numbers import Numbers
from .._reduce.logic import begun
from .changes import changed
from .event_history import EventHistory
from .field import Given
from .moment import Approach, carried_to_moment
from .run_events import RunEvents

TOGETHER = 10  # rounds in which all conditions that have become true act at once; later on they act one by one
# Why a run ends at an instant
STOPPED, ENDLESS, CONTRADICTED, ACCUMULATED, REFUSED = 1.0, 2.0, 3.0, 4.0, 5.0


class Counted(Protocol):
    """A round that knows its number."""

    @property
    def count(self) -> Array: ...


R = TypeVar("R", bound=Counted)


class Settled(NamedTuple):
    """What an instant leaves behind: its time, the vector, the truths of the relations, and the conditions that hold.
    `outcome` says why the run ends, 0 if it does not.
    """

    t: Array
    y: Array
    truths: Array
    holds: Array
    history: EventHistory
    outcome: Array


class _Round(NamedTuple):
    """One round; `ys` is the stepped vector twice: as it is read, and after what has happened."""

    t: Array
    ys: Array
    due: Array  # the events whose moment it is, and that have not happened yet
    ticks: Array  # those that wait for all else: what was set to happen now, and the clocks of this instant
    truths: Array
    holds: Array
    happened: Array
    first: Array  # the first that happened, -1 if none
    stored: Array  # energy before
    lost: Array
    order: Array  # at the start of a run, the last time of each past event
    n_own: Array  # rounds of events that were due
    history: EventHistory
    is_bad: Array
    goes_on: Array
    count: Any


def settle(
    events: RunEvents,
    t: Array,
    approach: Approach,
    y: Numbers,
    begins: Array,
    truths: Array,
    holds: Array,
    due: Array,
    history: EventHistory,
    given: Given,
    *,
    order: Array | None = None,
) -> Settled:
    """Carry out the events that begin at t, each at its own moment, then those that become true by them, and so on.

    Events that begin at one instant read the values before all of them. What they make true happens next, and then what
    that makes true. When nothing more follows, the clocks of this instant tick: they read the values that hold now, all
    of them the same, and set together; what they make true follows. If many rounds come to no end, the events of a
    round happen one by one, the first in the list first: alternatives such as the conduction of diodes then settle as
    the pivots of a linear complementarity problem do (Murty, `Linear Complementarity, Linear and Nonlinear
    Programming`, 1988, ch. 4).

    A relation keeps its truth while its crossing function is within its band.

    At the start of a run, `order` has the times of the past events. They happen in this order, and have no moments of
    their own. The energy account begins after what happens at the start, which is no loss.
    """
    is_start = order is not None
    total = events.total
    most = total + TOGETHER + 4 * total + 16
    clocks = events.clocks
    reset = events.resets_times

    def next_round(r: _Round) -> _Round:
        # At the start only scheduled events may be due: without any, what carries them out is not compiled.
        is_own = jnp.any(r.due) if not is_start or events.schedules else jnp.asarray(False)
        order = r.order if is_start else jnp.zeros(total)
        earliest = jnp.min(jnp.where(r.due, order, jnp.inf))
        now = earliest + given.tick(earliest)
        which = jnp.argmax(r.due & (order <= now))  # of those at one instant the first in the list
        own = (jnp.arange(total) == which) & is_own
        t, ys = r.t, r.ys
        if not is_start:
            moment, moved = carried_to_moment(events, which, t, approach, ys, due, given)
            t, ys = jnp.where(is_own, moment, t), jnp.where(is_own, moved, ys)
        here = events.here(t, jnp.where(is_own, ys[0], ys[1]), given, is_start=is_start)
        truths = jnp.where(is_own, r.truths, events.renewed(t, r.truths, here.margins, given))
        if is_start:
            truths = jnp.where(~is_own & (r.count == r.n_own), events.truths_at_start(t, here.margins, given), truths)
        true = events.circuit.hold(truths)
        held, due_later, times = r.holds, r.due & ~own, r.order
        told = remains = jnp.zeros_like(own)
        is_first = ~is_own & (r.count == r.n_own)
        if is_start:
            # At the start, a stop condition is met if it is exactly zero, else when it changes its sign.
            # An event that the search for the start has carried out is listed, but does not happen again. That search
            # sets discrete variables only: other variables that the event sets are set here.
            done = true & events.done(given)
            had, remains = done & (r.count == 0), done & events.remains & is_first
            is_told = events.settings.is_started and given.numbers.past is None
            told = (had | jnp.isfinite(r.order)) & (r.count == 0) & is_told
            held = jnp.where((events.stops | events.curved) & is_first, true, held | had & ~events.remains)
        begins = begun(true, held, events.either) & ~events.curved & ~events.waits
        one = begins & (jnp.cumsum(begins) == 1)
        fired = jnp.where(is_own, own, jnp.where(r.count < TOGETHER + jnp.sum(r.happened), begins, one))
        if is_start and events.settings.stop and events.settings.direction is not False:
            fired |= events.stops & (here.margins[-1] == 0) & is_first
        new, is_bad = changed(events, t, ys[1], here.values, fired, remains, given)
        any_fired = jnp.any(fired & events.acts)
        y = jnp.where(any_fired, new, ys[1])
        holds = jnp.where(is_own, held, true & (held | fired))
        holds = jnp.where(events.either & ~is_own, jnp.where(fired | events.curved, true, held), holds)
        base, ticks = ys[0], r.ticks
        if is_start:
            # Past events of one instant start from the values before all of them; those of the next instant, from the
            # values that these have left.
            is_now = due_later & (r.order <= now)
            # An event is due again only at those of its times that this round has changed.
            is_reset, last = events.set_anew(t, ys[1], y, given)
            is_reset &= ~is_now
            times = jnp.where(is_reset, last, r.order)
            due_later = is_own & jnp.isfinite(times) & (due_later | is_reset) & ~r.ticks
            base = jnp.where(is_own & (jnp.min(jnp.where(due_later, times, jnp.inf)) > now), y, base)
        else:
            if reset:
                # What is set to happen now, or earlier, happens now.
                is_moved, last = events.set_anew(t, ys[1], y, given)
                ticks |= is_moved & jnp.isfinite(last) & (~clocks | (last >= t - given.tick(t)))
        # When all else has happened, what was set to happen now happens, and then the clocks tick. They read what holds
        # now.
        is_quiet = ~is_own & ~jnp.any(fired) & ~jnp.any(due_later)
        following = jnp.where(jnp.any(ticks & ~clocks), ticks & ~clocks, ticks) & is_quiet
        due_later, ticks, base = due_later | following, ticks & ~following, jnp.where(is_own, base, y)
        stored = jnp.where(r.count == 0, here.stored, r.stored)
        return _Round(
            t,
            jnp.stack([base, y]),
            due_later,
            ticks,
            truths,
            holds,
            r.happened | fired,
            jnp.where((r.first < 0) & any_fired, jnp.argmax(fired & events.acts), r.first),
            stored,
            jnp.where(is_own, r.lost, stored - here.stored),
            times,
            r.n_own + is_own,
            r.history.noted(t, ys[0], (fired | told)[: events.n_model], events.is_listed[: events.n_model]),
            r.is_bad | (is_bad & any_fired),
            (is_own | jnp.any(fired) | jnp.any(due_later)) & ~jnp.any(fired & events.refused),
            r.count + 1,
        )

    none = jnp.zeros(total, bool)
    ticks = begins & clocks if order is None else begins & clocks & (order >= t - given.tick(t))
    start = _Round(
        jnp.asarray(t, float), jnp.stack([y, y]), begins & ~ticks, ticks, truths, holds, none,
        jnp.asarray(-1), jnp.asarray(0.0), jnp.asarray(0.0),
        jax.lax.stop_gradient(order) if is_start else jnp.zeros(0), jnp.asarray(0),
        history, jnp.asarray(False), jnp.any(begins) | is_start, jnp.asarray(0),
    )  # fmt: skip
    end = repeated(lambda r: r.goes_on, next_round, start, most, events.is_reversible)
    outcome = jnp.where(jnp.any(end.happened & events.stops), STOPPED, 0.0)
    outcome = jnp.where(jnp.any(end.happened & events.refused), REFUSED, outcome)
    outcome = jnp.where(end.is_bad, CONTRADICTED, outcome)
    outcome = jnp.where(end.goes_on, ENDLESS, outcome)
    return Settled(
        end.t, end.ys[1] if is_start else _accounted(events, end), end.truths, end.holds, end.history, outcome
    )


def repeated(goes_on: Callable[[R], Any], next_round: Callable[[R], R], start: R, most: int, is_reversible: bool) -> R:
    """Round after round, for `most` at most; reverse mode goes back through them where it is said to."""
    if is_reversible:
        return while_loop(goes_on, next_round, start, max_steps=most, kind="bounded", base=16)
    return jax.lax.while_loop(lambda r: goes_on(r) & (r.count < most), next_round, start)


def _accounted(events: RunEvents, end: _Round) -> Array:
    """The vector with the energy lost added to that of the first event that happened."""
    y, layout = end.ys[1], events.layout
    if not layout.n_losses:
        return y
    losses = y[layout.losses] + jnp.where(jnp.arange(layout.n_losses) == end.first, end.lost, 0.0)
    return layout.with_part(y, layout.losses, losses)
