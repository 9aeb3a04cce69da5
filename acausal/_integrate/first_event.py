"""The events that begin first in a step, and where a step has to end because of them."""

import functools as ft

import jax.numpy as jnp
from jax import Array

from .._numbers import Numbers
from .bend import no_bend
from .event_state import EventState
from .field import Given
from .found import Found, Start
from .interval import Seen, seen, seen_on_course
from .look import look
from .run_events import RunEvents
from .span import Span

PAST = 1e-9  # events are looked for beyond the end by this share of a step, which may be meant to end at one
NEAR = 1e-6  # a bend so near to the start of a step, as a share of it, does no harm within the step
AHEAD = 0.1  # a step that ends this share of it before a bend, or less, goes on to it along its own path


def first_event(
    events: RunEvents, path: Span, t0: Array, t1: Array, instant: Array, state: EventState, given: Given
) -> tuple[Found, Array]:
    """Which events begin first in a step, and when; and where the step should rather end, infinite if it is good as it
    is. Nothing happens in a step that has to be repeated up to there.
    """
    forward, numbers, due = given.direction, given.numbers, given.direction * state.due
    run_end, short = forward * numbers.t1, given.tick(t1)
    # An instant lies before the end of the run, up to which its last step then goes on.
    beyond = jnp.minimum(instant + short, jnp.nextafter(run_end, -jnp.inf))

    def latest(share: float) -> Array:
        """The time by this share of the step behind it, or the instant or end of the run that comes before."""
        t = t1 + share * (t1 - t0)
        return jnp.where(_reaches(t, instant, given) & (instant < run_end), beyond, jnp.minimum(t, run_end))

    end = latest(PAST)
    none, still = jnp.zeros(events.total, bool), jnp.zeros(events.total)
    never = jnp.asarray(False)
    found = Found(
        is_any=never, t=end, before=t1, pace=still, shift=state.seen.shift, begins=none, leaps=none,
        sides=jnp.zeros(events.n_margins, bool), margins=state.seen.g, zero=state.zero, left=state.zero,
        holds=state.holds, end=state.seen._replace(t=end), reached=end, bend=no_bend(), is_bent=never, band=state.band,
    )  # fmt: skip
    if events.is_searched:
        span, start = jnp.abs(numbers.t1 - numbers.t0), state.seen._replace(t=t0)
        conditions = events.conditions(ft.partial(_seen, events, path, given))
        limits = end, jnp.minimum(latest(AHEAD), _before_next_save(t1, given))
        begin = Start(start, ~state.jumped, state.holds, state.fresh, state.zero, state.band)
        found = look(conditions, begin, limits, span, short, numbers.rtol)
    goes_on = ~found.is_any & (found.end.t > end)
    t = jnp.where(found.is_any, found.t, found.end.t)
    is_there = (instant < run_end) & (instant <= t + short)
    # Beyond all that is due: equations have changed there.
    t = jnp.where(is_there, beyond, t)
    is_due = is_there & (due <= t)
    # A condition that leaps at a time known ahead becomes true by what happens there.
    begins = is_due | (found.begins & ~(found.leaps & is_there))
    before = jnp.minimum(jnp.where(found.is_any, found.before, t), jnp.where(is_there, instant - 0.5 * short, t))
    # The search ends before t1 where a run ends just behind an instant.
    is_partial = ~found.is_any & (found.reached < jnp.minimum(t1, end))
    cut = _cut(found, is_partial, t0, t1, given)
    is_whole = jnp.isinf(cut)
    is_any, begins = (jnp.any(begins) | goes_on) & is_whole, begins & is_whole
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


def _cut(found: Found, is_partial: Array, t0: Numbers, t1: Array, given: Given) -> Array:
    """Where a step has to end so that the event comes at its end, or where `is_partial`, as far as it was searched;
    infinite where the event may lie within the step.

    A step with stages beyond a bend ends some way before it, or at the event before it.
    """
    (bend, room), near = found.bend, t0 + NEAR * (t1 - t0)
    before, beside, is_far = found.before, near, found.before > near
    is_cut = (bend > near) & (bend < t1 + room)
    before = jnp.where(is_cut, jnp.minimum(bend - jnp.minimum(2.0 * room, 0.5 * (bend - t0)), before), before)
    is_cut = is_far & (is_cut | (found.is_any & found.is_bent & (found.t < t1)))
    if given.numbers.times is not None:
        saves = given.direction * given.numbers.times
        later = jnp.min(jnp.where(saves > found.t, saves, jnp.inf), initial=jnp.inf)
        is_cut |= found.is_any & (later <= t1)
        beside = jnp.minimum(near, 0.5 * (found.t + later))
    # Until an event that is so near, a state may not change by more than rounding. Then the step ends beyond it.
    before = jnp.where(is_far, before, beside)
    least = t0 + 4.0 * given.tick(t0)
    to = jnp.maximum(jnp.where(is_partial, found.reached, before), least)
    return jnp.where((is_cut | is_partial) & (t1 > 2.0 * least - t0), to, jnp.inf)


def _before_next_save(t1: Array, given: Given) -> Array:
    """The time just before the first one to save at behind a step, whose dense output does not tell it."""
    if given.numbers.times is None:
        return jnp.asarray(jnp.inf)
    saves = given.direction * given.numbers.times
    return jnp.nextafter(jnp.min(jnp.where(saves > t1, saves, jnp.inf), initial=jnp.inf), -jnp.inf)


def _reaches(t: Numbers, instant: Array, given: Given) -> Array:
    return instant <= t + given.tick(t)


def short_of(t1: Array, instant: Array, given: Given) -> Array:
    """The end of a step that leads to an instant, just before it: nothing has changed there yet. t1 is the instant but
    for rounding, or the end of a run just behind it.
    """
    # Not the minimum, whose derivative is half of each where an instant is the end of the run: that moves with it.
    nearest = jnp.where(instant < t1, instant, t1)
    return jnp.where(_reaches(t1, instant, given), nearest - 0.5 * given.tick(t1), t1)
