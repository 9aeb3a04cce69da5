"""The events that begin first in a step, and where a step has to end because of them."""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from .._numbers import Numbers
from .conditions import EventConditions
from .event_state import EventState
from .field import Given
from .interval import Seen
from .look import Found, look
from .run_events import RunEvents
from .span import Span

PAST = 1e-9  # events are looked for beyond the end by this share of a step, which may be meant to end at one
NEAR_END = 1e-6  # a bend so near to an end of a step, as a share of it, does no harm within the step


class FirstEvent(NamedTuple):
    """The events that begin first in a step, at t, if there `is_any`, a time just `before`, and the `pace` of the
    margins of all events there; and where the step should rather end, the `cut`, infinite if it is good as it is.
    """

    is_any: Array
    t: Array
    before: Array
    pace: Array
    begins: Array
    sides: Array
    zero: Array
    holds: Array
    seen: Seen  # the margins at the end
    cut: Array


def first_event(
    events: RunEvents, path: Span, t0: Array, t1: Array, instant: Array, state: EventState, given: Given
) -> FirstEvent:
    """Which events begin first in a step, and when; none where it has to be repeated up to there."""
    forward, numbers, due = given.direction, given.numbers, given.direction * state.due
    run_end, short = forward * numbers.t1, given.tick(t1)
    arrives = _reaches(t1, instant, given) & (instant < run_end)
    end = jnp.where(arrives, instant + short, jnp.minimum(t1 + PAST * (t1 - t0), run_end))
    none, still = jnp.zeros(events.total, bool), jnp.zeros(events.total)
    no_sides = jnp.zeros(events.n_margins, bool)
    found = Found(jnp.asarray(False), end, t1, still, none, none, no_sides, state.zero, state.holds, state.seen, end)
    if events.is_searched:
        span = jnp.abs(numbers.t1 - numbers.t0)
        margins = lambda t: events.margins(forward * t, path.evaluate(t), given)  # noqa: E731
        conditions = EventConditions(margins, events.circuit, events.reads, events.either, events.moves)
        start = state.seen._replace(t=t0)
        found = look(conditions, start, ~state.jumped, end, state.holds, state.fresh, state.zero, span, short)
    t = jnp.where(found.is_any, found.t, end)
    is_there = arrives & (instant <= t + short)
    # Beyond all that is due: equations have changed there.
    t = jnp.where(is_there, end, t)
    is_due = is_there & (due <= t)
    # A condition that leaps at a time known ahead becomes true by what happens there.
    begins = is_due | (found.begins & ~(found.leaps & is_there))
    before = jnp.minimum(jnp.where(found.is_any, found.before, t), jnp.where(is_there, t1 - 0.5 * short, t))
    cut = _cut(events, found, t0, t1, given)
    is_whole = jnp.isinf(cut)
    return FirstEvent(
        jnp.any(begins) & is_whole,
        t,
        before,
        found.pace,
        begins & is_whole,
        found.sides,
        found.zero,
        found.holds,
        found.end,
        cut,
    )


def _cut(events: RunEvents, found: Found, t0: Numbers, t1: Array, given: Given) -> Array:
    """Where a step has to end so that an event lies at its end; infinite where it may lie within the step."""
    near = beside = t0 + NEAR_END * (t1 - t0)
    is_cut = jnp.any(found.begins & events.bends) & (found.t > near) & (t1 - found.t > near - t0)
    is_late = ~found.is_any & (found.reached < t1)
    if given.numbers.times is not None:
        saves = given.direction * given.numbers.times
        later = jnp.min(jnp.where(saves > found.t, saves, jnp.inf), initial=jnp.inf)
        is_cut |= found.is_any & (later <= t1)
        beside = jnp.minimum(near, 0.5 * (found.t + later))
    # Until an event that is so near, a state may not change by more than rounding. Then the step ends beyond it.
    before = jnp.where(found.before > near, found.before, beside)
    least = t0 + 4.0 * given.tick(t0)
    to = jnp.maximum(jnp.where(is_late, found.reached, before), least)
    return jnp.where((is_cut | is_late) & (t1 > 2.0 * least - t0), to, jnp.inf)


def _reaches(t: Numbers, instant: Array, given: Given) -> Array:
    return instant <= t + given.tick(t)


def short_of(t1: Array, instant: Array, given: Given) -> Array:
    """The end of a step that leads to an instant, just before it: nothing has changed there yet."""
    return jnp.where(_reaches(t1, instant, given), t1 - 0.5 * given.tick(t1), t1)
