"""The events that begin first in a step, and where a step has to end because of them."""

import functools as ft

import jax.numpy as jnp
from jax import Array

from .._numbers import Numbers
from .conditions import EventConditions
from .event_state import EventState
from .field import Given
from .interval import Seen, seen, seen_on_course
from .look import Found, look
from .run_events import RunEvents
from .span import Span

PAST = 1e-9  # events are looked for beyond the end by this share of a step, which may be meant to end at one
NEAR_END = 1e-6  # a bend so near to an end of a step, as a share of it, does no harm within the step


def first_event(
    events: RunEvents, path: Span, t0: Array, t1: Array, instant: Array, state: EventState, given: Given
) -> tuple[Found, Array]:
    """Which events begin first in a step, and when; and where the step should rather end, infinite if it is good as it
    is. Nothing happens in a step that has to be repeated up to there.
    """
    forward, numbers, due = given.direction, given.numbers, given.direction * state.due
    run_end, short = forward * numbers.t1, given.tick(t1)
    arrives = _reaches(t1, instant, given) & (instant < run_end)
    # An instant lies before the end of the run, up to which its last step then goes on.
    beyond = jnp.minimum(instant + short, jnp.nextafter(run_end, -jnp.inf))
    end = jnp.where(arrives, beyond, jnp.minimum(t1 + PAST * (t1 - t0), run_end))
    none, still = jnp.zeros(events.total, bool), jnp.zeros(events.total)
    sides, never = jnp.zeros(events.n_margins, bool), jnp.asarray(False)
    shift, zero = state.seen.shift, state.zero
    found = Found(never, end, t1, still, shift, none, none, sides, zero, state.holds, state.seen, end)
    if events.is_searched:
        span = jnp.abs(numbers.t1 - numbers.t0)
        look_at = ft.partial(_seen, events, path, given)
        conditions = EventConditions(look_at, events.circuit, events.reads, events.either, events.moves)
        start = state.seen._replace(t=t0)
        found = look(conditions, start, ~state.jumped, end, state.holds, state.fresh, state.zero, span, short)
    t = jnp.where(found.is_any, found.t, end)
    is_there = arrives & (instant <= t + short)
    # Beyond all that is due: equations have changed there.
    t = jnp.where(is_there, end, t)
    is_due = is_there & (due <= t)
    # A condition that leaps at a time known ahead becomes true by what happens there.
    begins = is_due | (found.begins & ~(found.leaps & is_there))
    before = jnp.minimum(jnp.where(found.is_any, found.before, t), jnp.where(is_there, short_of(t1, instant, given), t))
    # The search ends before t1 where a run ends just behind an instant.
    is_partial = ~found.is_any & (found.reached < jnp.minimum(t1, end))
    cut = _cut(events, found, is_partial, t0, t1, given)
    is_whole = jnp.isinf(cut)
    is_any, begins = jnp.any(begins) & is_whole, begins & is_whole
    return found._replace(is_any=is_any, t=t, before=before, begins=begins), cut


def _seen(events: RunEvents, path: Span, given: Given, t: Numbers) -> Seen:
    """The margins at a time on the path of a step."""
    forward, course = given.direction, path.course
    if course is None:
        return seen(lambda t: events.margins(forward * t, path.plain(t), given), t)

    def values(t: Numbers, y: Array) -> tuple[Array, Array]:
        margins, rates = events.margins_and_rates(forward * t, y, given)
        return margins, forward * rates

    return seen_on_course(values, path.plain, ft.partial(course.error, path.inner), t)


def _cut(events: RunEvents, found: Found, is_partial: Array, t0: Numbers, t1: Array, given: Given) -> Array:
    """Where a step has to end so that an event lies at its end, or where `is_partial`, as far as it was searched;
    infinite where the event may lie within the step.
    """
    near = beside = t0 + NEAR_END * (t1 - t0)
    is_cut = jnp.any(found.begins & events.bends) & (found.t > near) & (t1 - found.t > near - t0)
    if given.numbers.times is not None:
        saves = given.direction * given.numbers.times
        later = jnp.min(jnp.where(saves > found.t, saves, jnp.inf), initial=jnp.inf)
        is_cut |= found.is_any & (later <= t1)
        beside = jnp.minimum(near, 0.5 * (found.t + later))
    # Until an event that is so near, a state may not change by more than rounding. Then the step ends beyond it.
    before = jnp.where(found.before > near, found.before, beside)
    least = t0 + 4.0 * given.tick(t0)
    to = jnp.maximum(jnp.where(is_partial, found.reached, before), least)
    return jnp.where((is_cut | is_partial) & (t1 > 2.0 * least - t0), to, jnp.inf)


def _reaches(t: Numbers, instant: Array, given: Given) -> Array:
    return instant <= t + given.tick(t)


def short_of(t1: Array, instant: Array, given: Given) -> Array:
    """The end of a step that leads to an instant, just before it: nothing has changed there yet. t1 is the instant but
    for rounding, or the end of a run just behind it.
    """
    # Not the minimum, whose derivative is half of each where an instant is the end of the run: that moves with it.
    nearest = jnp.where(instant < t1, instant, t1)
    return jnp.where(_reaches(t1, instant, given), nearest - 0.5 * given.tick(t1), t1)
