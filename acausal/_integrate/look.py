"""The search for the first event within a step."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.flatten_util import ravel_pytree

from .._compiled_once import truths_compiled_once
from .._numbers import Numbers
from .bend import next_bend, no_bend
from .conditions import EventConditions, sign_of
from .found import Found, Start
from .interval import PARTS, TURN, Seen, advance, judged, over

MOST = 200  # points of a step at which margins are computed
TOO_SOON = 1e-11  # share of the time span within which an event does not happen again
STILL = 1e-8  # rate of a margin, as a share of that with which it came to zero, below which it stays there


class _Search(NamedTuple):
    """The state of the search: nothing happens before `low`, where the relations `above` and the conditions `holds` are
    true.

    The first event is looked for up to `high`, and if there is none, up to `end`. The interval to be judged next begins
    at `low`. It ends at x, which is yet to be looked at: the start, then the end, then points in between; or where
    `is_seen`, at `high`, which has been looked at before. Margins are counted from `offset`, what they are at the start
    where that counts as zero. There, the relations `was` hold; behind the interval, those
    `after`. `low`, `high`, `end` and, if there are bends, the start as `first` are `Seen` as flat
    vectors: each is chosen by one operation.
    """

    first: Array
    low: Array
    high: Array
    end: Array
    was: Array
    above: Array
    after: Array
    holds: Array
    offset: Array
    x: Array
    is_seen: Array
    begins: Array
    is_found: Array
    is_over: Array
    count: Any


def look(
    conditions: EventConditions,
    begin: Start,
    limits: tuple[Array, Array],
    span: Numbers,
    short: Numbers,
    rtol: Numbers,
) -> Found:
    """The first event after the start of a step.

    Conditions that have just become true happen again only after they were false. Margins that were zero have not left
    it as long as they are no larger than by rounding: gentle ones keep their side there. Times closer than `short` are
    one and the same, and what happens within a tiny share of the `span` of the run is due to rounding.

    Margins of relations and their rates are taken at both ends. Where they are so far from zero that their variation
    over the step does not bring them there, or what else holds makes them idle, that is all; else the step is looked at
    in four parts, and in more of them where an angle, of which a sine is taken, turns by more than a quarter in each:
    while nothing moves, steps are longer than the periods of what makes margins vary. On a part a relation has changed
    where its margin has another sign at the end, and may have changed where its rates point at zero from both ends, and
    the tangents meet beyond it; where a condition becomes true by that, or may do so, the part is narrowed down to
    rounding. So an event is found if each margin turns at most once on each part, and bends one way where it does.

    The `limits` are the end of the step, and that of the search where nothing happens up to there but an equation is
    about to bend.
    """
    start, is_known, holds, fresh, zero, _ = begin
    (end, limit), has_bends = limits, bool(np.any(conditions.bends))
    length, no = end - start.t, jnp.asarray(False)
    flat_start, unflat = ravel_pytree(start)
    flat_end = _flat(start._replace(t=end))

    def next_point(s: _Search) -> _Search:
        is_start, is_first = s.count == 0, ~s.is_seen & (s.count == 1)
        low, farthest = unflat(s.low), unflat(s.end).t
        is_end = ~s.is_seen & (s.x >= farthest)
        left, first = _at_start(conditions, low, fresh, zero, span)
        offset, above = jnp.where(is_first, left, s.offset), jnp.where(is_first, first, s.above)
        low = low._replace(g=low.g - jnp.where(is_first, left, 0.0))

        def looked() -> Array:
            there = conditions.seen(s.x)
            return _flat(there._replace(g=there.g - offset))

        flat_new = jax.lax.cond(s.is_seen, lambda: s.high, looked)
        flat_last = jnp.where(is_end, flat_new, s.end)
        new, last, flat_low = unflat(flat_new), unflat(flat_last), _flat(low)
        flat_first = jnp.where(is_first, flat_low, s.first) if has_bends else flat_low
        verdict = judged(conditions, length, short, s.count, low, new, above, s.holds, fresh & is_first)
        is_at_once = is_first & jnp.any(verdict.at_once)
        is_at_once, passes, is_found = truths_compiled_once(
            s.x, is_at_once, is_start | (verdict.passes & ~is_at_once), is_at_once | (~is_start & verdict.is_found)
        )
        # Behind an interval on which nothing happens lies the rest up to `high`, or else the next part of the step.
        part = jnp.minimum(length / PARTS, over(TURN * (last.t - new.t), advance(new, last)))
        onward = jnp.where(is_start, end, new.t + jnp.minimum(part, 0.5 * (last.t - new.t)))
        behind = jnp.where(s.is_seen | is_end, flat_last, s.high)
        is_last, goes_on = passes & ~is_start & (new.t >= last.t), jnp.asarray(False)
        if has_bends:
            bend = next_bend(conditions, low, new, verdict.after).t
            goes_on = is_last & (last.t < limit) & (bend < limit)
            onward = jnp.where(is_last, jnp.minimum(2.0 * bend - new.t + short, limit), onward)
        return _Search(
            first=flat_first if has_bends else s.first,
            low=jnp.where(passes, flat_new, flat_low),
            high=jnp.where(is_at_once, flat_low, jnp.where(passes, behind, flat_new)),
            end=flat_last,
            was=jnp.where(is_first, above, s.was),
            above=jnp.where(passes, verdict.after, above),
            after=jnp.where(is_at_once, above, verdict.after),
            holds=jnp.where(is_start, s.holds, jnp.where(passes, verdict.holds_after, verdict.holds)),
            offset=offset,
            x=jnp.where(passes, onward, verdict.x),
            is_seen=~is_start & passes & ~s.is_seen,
            begins=jnp.where(is_at_once, verdict.at_once, verdict.begins),
            is_found=is_found,
            is_over=is_found | (is_last & ~goes_on) | (s.count > MOST),
            count=s.count + ~s.is_seen,
        )

    search = _Search(
        first=flat_start if has_bends else jnp.zeros(0),
        low=flat_start,
        high=flat_end,
        end=flat_end,
        was=jnp.zeros(start.g.shape, bool),
        above=jnp.zeros(start.g.shape, bool),
        after=jnp.zeros(start.g.shape, bool),
        holds=holds,
        offset=jnp.zeros_like(start.g),
        x=jnp.where(is_known, end, start.t),
        is_seen=no,
        begins=jnp.zeros_like(holds),
        is_found=no,
        is_over=no,
        count=jnp.where(is_known, 1, 0),
    )
    s = jax.lax.while_loop(lambda s: ~s.is_over, next_point, search)
    low, high, last = unflat(s.low), unflat(s.high), unflat(s.end)
    first = unflat(s.first) if has_bends else last
    found = _found(conditions, s, low, high, last, begin, span, short, rtol)
    if not has_bends:
        return found
    above = last.g > 0
    is_bent = jnp.any(conditions.bends & (s.was != above))
    # Behind an event at which nothing bends, it is the end of the step that tells of a bend, where that has not bent.
    bends = conditions.bends & (s.after != s.above)
    is_end = s.is_found & (high.t < last.t) & ~is_bent & ~jnp.any(bends)
    at = unflat(jnp.where(is_end, s.end, s.low))
    bend = next_bend(conditions, first, at, jnp.where(is_end, above, s.above))
    return found._replace(bend=bend, is_bent=is_bent)


def _flat(seen: Seen) -> Array:
    return ravel_pytree(seen)[0]


def _at_start(
    conditions: EventConditions, start: Seen, fresh: Array, zero: Array, span: Numbers
) -> tuple[Array, Array]:
    """The margins at the start that count as zero, 0 for all others, and the relations that hold just after it.

    The margin of an event that has just happened is zero but for rounding; what counts is whether it will rise. A
    gentle one keeps its side instead until it passes zero by more than rounding: it is counted from there.
    """
    is_fresh = jnp.any(fresh[:, None] & conditions.reads, axis=0)
    size, rounding = jnp.abs(start.g), TOO_SOON * span * jnp.abs(start.rate)
    is_wrong = (size < jnp.abs(zero)) & ((start.g > 0) != (zero > 0))
    is_zero = (is_fresh & (size < rounding)) | is_wrong
    rises = jnp.where(rounding > STILL * jnp.abs(zero), start.rate > 0, zero > 0)
    offset, above = jnp.where(is_zero, start.g, 0.0), jnp.where(is_zero | (start.g == 0), rises, start.g > 0)
    keeps = (size < jnp.abs(zero)) & conditions.gentle
    return jnp.where(keeps, -zero, offset), jnp.where(keeps, zero > 0, above)


def _found(
    conditions: EventConditions,
    s: _Search,
    low: Seen,
    high: Seen,
    end: Seen,
    begin: Start,
    span: Numbers,
    short: Numbers,
    rtol: Numbers,
) -> Found:
    """What a search that is over has found between `low` and `high`."""
    after, margins = s.after, high.g + s.offset
    least = TOO_SOON * span * jnp.maximum(jnp.abs(low.rate), jnp.abs(high.rate))
    # What is zero but for rounding, and has not passed it, is about to pass it or has come from there.
    is_zero = jnp.abs(high.g) < least
    sides = jnp.where(is_zero & (after == s.above), high.rate > 0, after)
    left = jnp.where(jnp.abs(margins) < jnp.abs(begin.zero), sign_of(sides) * jnp.abs(begin.zero), 0.0)
    zero = jnp.where(is_zero, sign_of(sides) * least, 0.0)
    ahead = end.g + s.offset
    there = jnp.where(s.is_found, margins, ahead)
    swing, passed = jnp.abs(high.rate) * (high.t - begin.seen.t), s.is_found & (sides != s.above)
    band = begin.band.after(there, passed, swing, ahead, rtol).shared(there, conditions.mates)
    half = band.half_width(conditions.bends, rtol)
    half = jnp.where(conditions.gentle & (jnp.abs(margins) < half), half, 0.0)
    zero, left = (jnp.where(half > jnp.abs(other), sign_of(sides) * half, other) for other in (zero, left))
    without = jnp.where(jnp.abs(high.g - low.g) > least, s.above, sides)
    # Conditions behind the moment, without what moves through zero there, and how fast they change: in one evaluation.
    still = jnp.zeros_like(high.g)
    rows, rates = jnp.stack([sign_of(sides), sign_of(without), high.g]), jnp.stack([still, still, high.rate])
    found, changes = jax.jvp(jax.vmap(lambda g: conditions.logic(g, -g)), (rows,), (rates,))
    (true, true_without, _), (_, _, pace) = found, changes
    begins = (s.begins | conditions.begun(true > 0, s.holds)) & s.is_found
    leaps = begins & ~conditions.begun(true_without > 0, s.holds) & jnp.any(after != s.above)
    pace = jnp.where(jnp.isfinite(pace), pace, 0.0)
    given_up = jnp.where(low.t > begin.seen.t + short, low.t, high.t)
    reached = jnp.where(s.is_found | (low.t >= end.t), end.t, given_up)
    return Found(
        is_any=s.is_found, t=high.t, before=low.t, pace=pace, shift=high.shift[:1] + low.shift[1:], begins=begins,
        leaps=leaps, sides=sides, margins=margins, zero=zero, left=left, holds=s.holds,
        end=end._replace(g=ahead), reached=reached, bend=no_bend(), is_bent=jnp.asarray(False), band=band,
    )  # fmt: skip
