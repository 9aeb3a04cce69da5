"""What happens at one instant: events and what follows from them, until nothing more does."""

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol, TypeVar

import jax
import jax.numpy as jnp
from jax import Array

from .._equinox_private import while_loop
from .._numbers import Numbers
from .._reduce.margins import LEAST
from .changes import changed
from .event_history import EventHistory
from .field import Given
from .moment import Approach, carried_to_moment
from .run_events import RunEvents

TOGETHER = 10  # rounds of consequences in which all that has become true happens at once; later on one by one
# Why a run ends at an instant
STOPPED, ENDLESS, CONTRADICTED, REFUSED = 1.0, 2.0, 3.0, 5.0


class Counted(Protocol):
    """A round that knows its number."""

    @property
    def count(self) -> Array: ...


R = TypeVar("R", bound=Counted)


class Settled(NamedTuple):
    """What an instant leaves behind: its time, the vector, the conditions that hold, those that have just become true
    and stayed so, which margins are zero but for rounding, and the `change` of margins by what happened. `outcome` says
    why the run ends, 0 if it does not.
    """

    t: Array
    y: Array
    holds: Array
    fresh: Array
    zero: Array
    change: Array
    history: EventHistory
    outcome: Array


class _Round(NamedTuple):
    """One round of `settle`; `ys` is the stepped vector twice: before the events of this instant, and after them."""

    t: Array
    ys: Array
    due: Array  # the events whose moment it is, and that have not happened yet
    holds: Array
    happened: Array
    undone: Array  # those that happened and whose variables others have set anew, after their condition had ended
    margins: Array  # in the first round
    zero: Array  # how far margins may be from zero by rounding
    change: Array  # by how much the margins are no longer what they were in the first round
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
    holds: Array,
    due: Array,
    history: EventHistory,
    given: Given,
    *,
    order: Array | None = None,
) -> Settled:
    """Carry out the events that begin at t, each at its own moment, then those that become true by them, and so on. At
    the time before of the `approach` none of them had begun.

    Events that begin at one instant start from the values before all of them. What they make true happens next; what
    that makes true, after it. Where many rounds come to no end, the events of a round happen one by one, the first in
    the list first: alternatives such as the conduction of diodes then settle as the pivots of a linear complementarity
    problem do (Murty, `Linear Complementarity, Linear and Nonlinear Programming`, 1988, ch. 4).

    The search for events has told which relations hold from t on, the `sides` of the approach. They do until events
    change their margins; those that are `zero` but for rounding, by more than that, or to exactly zero. Where equations
    do not jump, a margin that has changed is that of another limit.

    At the start of a run, `order` has the times of the past events. They have no moments of their own there, and each
    tells anew what is due between its time and the start, as it would have done then. The energy account begins after
    what happens at the start, which is no loss.
    """
    is_start = order is not None
    if events.only_stops:
        t, y = jnp.asarray(t, float), jnp.asarray(y)
        if is_start:
            here = events.here(t, y, given)
            is_met = here.is_zero[None] & (events.settings.direction is not False)
            return _stopped(t, y, here.truths, is_met, approach.zero, history)
        moment, (moved,) = carried_to_moment(events, jnp.asarray(0), t, approach, y[None], due, given)
        is_any = jnp.any(begins)
        return _stopped(
            jnp.where(is_any, moment, t), jnp.where(is_any, moved, y), holds ^ begins, begins, approach.zero, history
        )
    total = events.total
    most = total + TOGETHER + 4 * total + 16

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
        truths, margins, zero, change = here.truths, r.margins, r.zero, r.change
        if not is_start:
            margins = jnp.where(r.count == 0, here.margins, r.margins)
            is_same = here.margins == margins
            change = jnp.where(is_same, 0.0, jnp.abs(here.margins - margins))
            zero = jnp.where((events.gentle | (jnp.abs(here.margins) <= LEAST)) & ~is_same, 0.0, r.zero)
            is_told = is_same | (jnp.abs(here.margins) < jnp.abs(zero))
            truths = events.true(jnp.where(is_told, approach.sides, here.margins > 0))
        held, due_later, times = r.holds, r.due & ~own, r.order
        told = remains = jnp.zeros_like(own)
        is_first = ~is_own & (r.count == r.n_own)
        if is_start:
            # At the start, a stop condition is met if it is exactly zero, else when it changes its sign.
            # An event that the search for the start has carried out is listed, but does not happen again. That search
            # sets discrete variables only: other variables that the event sets are set here.
            done = truths & events.done(given)
            had, remains = done & (r.count == 0), done & events.remains & is_first
            is_told = events.settings.is_started and given.numbers.past is None
            told = (had | jnp.isfinite(r.order)) & (r.count == 0) & is_told
            held = jnp.where((events.stops | events.bends) & is_first, truths, held | had & ~events.remains)
        fired = jnp.where(is_own, own, _consequences(events, truths, held, r))
        if is_start:
            is_met = here.is_zero & (events.settings.direction is not False) & is_first
            fired |= events.stops & is_met
        new, is_bad = changed(events, t, ys[1], here.values, fired, remains, given)
        y = jnp.where(jnp.any(fired & events.acts), new, ys[1])
        holds = jnp.where(is_own, held | own, truths & (held | fired))
        holds = jnp.where(events.either, jnp.where(is_own, held ^ own, truths), holds)
        base = ys[0]
        if is_start:
            # Past events of one instant start from the values before all of them; those of the next instant, from the
            # values that these have left.
            is_now = due_later & (r.order <= now)
            # An event is due again only if this round has changed its time. Both times are computed here, in the same
            # way, so that they do not differ by rounding.
            was, new = jax.vmap(lambda y: events.past(t, y, given))(jax.lax.stop_gradient(jnp.stack([ys[1], y])))
            times = jnp.where((new != was) & ~is_now, jax.lax.stop_gradient(new), r.order)
            due_later = is_own & jnp.isfinite(times) & (is_now | (times > now))
            base = jnp.where(is_own & (jnp.min(jnp.where(due_later, times, jnp.inf)) > now), y, base)
        stored = jnp.where(r.count == 0, here.stored, r.stored)
        any_fired = jnp.any(fired & events.acts)
        return _Round(
            t,
            jnp.stack([base, y]),
            due_later,
            holds,
            r.happened | fired,
            (r.undone | (r.happened & ~truths & _set_anew(events, fired))) & ~fired,
            margins,
            zero,
            change,
            jnp.where((r.first < 0) & any_fired, jnp.argmax(fired & events.acts), r.first),
            stored,
            jnp.where(is_own, r.lost, stored - here.stored),
            times,
            r.n_own + is_own,
            r.history.noted(t, ys[0], (fired | told)[: events.n_model], events.is_listed[: events.n_model]),
            r.is_bad | (is_bad & any_fired),
            is_own | jnp.any(fired),
            r.count + 1,
        )

    start = _Round(
        jnp.asarray(t, float), jnp.stack([y, y]), begins, holds, jnp.zeros(total, bool), jnp.zeros(total, bool),
        jnp.zeros_like(approach.zero), approach.zero, jnp.zeros_like(approach.zero),
        jnp.asarray(-1), jnp.asarray(0.0), jnp.asarray(0.0),
        jax.lax.stop_gradient(order) if is_start else jnp.zeros(0), jnp.asarray(0),
        history, jnp.asarray(False), jnp.any(begins) | is_start, jnp.asarray(0),
    )  # fmt: skip
    end = repeated(lambda r: r.goes_on, next_round, start, most, events.is_reversible)
    outcome = jnp.where(jnp.any(end.happened & events.stops), STOPPED, 0.0)
    outcome = jnp.where(jnp.any(end.happened & events.refused), REFUSED, outcome)
    outcome = jnp.where(end.is_bad, CONTRADICTED, outcome)
    outcome = jnp.where(end.goes_on, ENDLESS, outcome)
    fresh = end.happened & ~end.undone & (end.holds | ~events.continuous)
    y = end.ys[1] if is_start else _accounted(events, end)
    return Settled(end.t, y, end.holds, fresh, end.zero, end.change, end.history, outcome)


def _stopped(t: Array, y: Array, holds: Array, begins: Array, zero: Array, history: EventHistory) -> Settled:
    """What is left behind where nothing can happen but the end of the run: without changes there are no rounds."""
    outcome = jnp.where(jnp.any(begins), STOPPED, 0.0)
    return Settled(t, y, holds, begins, zero, jnp.zeros_like(zero), history, outcome)


def repeated(goes_on: Callable[[R], Any], next_round: Callable[[R], R], start: R, most: int, is_reversible: bool) -> R:
    """Round after round, for `most` at most; reverse mode goes back through them where it is said to."""
    if is_reversible:
        return while_loop(goes_on, next_round, start, max_steps=most, kind="bounded", base=16)
    return jax.lax.while_loop(lambda r: goes_on(r) & (r.count < most), next_round, start)


def _consequences(events: RunEvents, truths: Array, held: Array, r: _Round) -> Array:
    """What has become true by the last round."""
    begun = jnp.where(events.either, truths != held, truths & ~held) & ~events.bends
    begun &= ~events.waits
    one = begun & (jnp.cumsum(begun) == 1)
    return jnp.where(r.count < TOGETHER + jnp.sum(r.happened), begun, one)


def _set_anew(events: RunEvents, fired: Array) -> Array:
    """The events that set one of the discrete variables which those that `fired` set."""
    number, _, is_own = events.writes
    if not number.size:
        return jnp.zeros_like(fired)
    is_set = jnp.any(fired[number] & is_own, axis=0)
    # Looked up rather than scattered, with which XLA on CPU does not compile the loop of steps as one function.
    return jnp.any(jnp.concatenate([jnp.zeros(1, bool), is_set])[events.places_written], axis=1)


def _accounted(events: RunEvents, end: _Round) -> Array:
    """The vector with the energy lost added to that of the first event that happened."""
    y, layout = end.ys[1], events.layout
    if not layout.n_losses:
        return y
    losses = y[layout.losses] + jnp.where(jnp.arange(layout.n_losses) == end.first, end.lost, 0.0)
    return layout.with_part(y, layout.losses, losses)
