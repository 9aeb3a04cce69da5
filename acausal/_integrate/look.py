"""The search for the first event within a step."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jax.flatten_util import ravel_pytree

from .._indices import decided_once
from .._numbers import Numbers
from .conditions import EventConditions, sign_of, signs
from .interval import PARTS, TURN, Seen, advance, judged, over

MOST = 200  # points of a step at which margins are computed
TOO_SOON = 1e-11  # share of the time span within which an event does not happen again
STILL = 1e-8  # rate of a margin, as a share of that with which it came to zero, below which it stays there


class Found(NamedTuple):
    """The first events in a step, if there `is_any`.

    - `begins`: which events happen first, at the time `t`; at `before`, just before it, they do not happen yet.
    - `pace`: how fast the margin of each event changes at t.
    - `shift`: see `Seen`, at t.
    - `leaps`: those of them whose margin jumps, instead of passing zero.
    - `sides`: the relations that hold from t on, or from the end of the search.
    - `zero`: how far the margins of those that are zero there may be from it by rounding, negative where a relation
      does not hold; 0 for all others.
    - `end`, `holds`: the margins where the search ended, and the conditions that hold there.
    - `reached`: up to where the step was searched; less than its end where that took too many points.
    """

    is_any: Array
    t: Array
    before: Array
    pace: Array
    shift: tuple[Array, ...]
    begins: Array
    leaps: Array
    sides: Array
    zero: Array
    holds: Array
    end: Seen
    reached: Numbers


class _Search(NamedTuple):
    """The state of the search: nothing happens before `low`.

    At `low` the relations `above` and the conditions `holds` are true. The first event after it is looked for up to
    `high`, and if there is none, up to `end`; these three are `Seen` as flat vectors. The next point to be looked at is
    x, unless nothing is known yet of the interval up to `high`: the start, then the end, then points in between.
    """

    low: Array
    high: Array
    end: Array
    above: Array
    holds: Array
    offset: Array
    x: Array
    looks: Array
    begins: Array
    is_found: Array
    is_over: Array
    count: Any


def look(
    conditions: EventConditions,
    start: Seen,
    is_known: Array,
    end: Array,
    holds: Array,
    fresh: Array,
    zero: Array,
    span: Numbers,
    short: Numbers,
) -> Found:
    """The first event after `start`, of which all but the time may be unknown.

    `holds` are the conditions that hold at the start, and `fresh` those that have just become true: they happen again
    only after they were false. Margins that were `zero` have not left it as long as they are no larger than that. Times
    closer than `short` are one and the same, and what happens within a tiny share of the `span` of the run is due to
    rounding.

    Margins of relations and their rates are taken at both ends. Where they are so far from zero that their variation
    over the step does not bring them there, or what else holds makes them idle, that is all; else the step is looked at
    in four parts, and in more of them where an angle, of which a sine is taken, turns by more than a quarter in each:
    while nothing moves, steps are longer than the periods of what makes margins vary. On a part a relation has changed
    where its margin has another sign at the end, and may have changed where its rates point at zero from both ends, and
    the tangents meet beyond it; where a condition becomes true by that, or may do so, the part is narrowed down to
    rounding. So an event is found if each margin turns at most once on each part, and bends one way where it does.
    """
    length, none, no = end - start.t, jnp.zeros_like(holds), jnp.asarray(False)
    last, unflat = ravel_pytree(start._replace(t=end))

    def next_point(s: _Search) -> _Search:
        low, is_start, is_end = unflat(s.low), s.count == 0, s.looks & (s.count == 1)
        # The margin of an event that has just happened is zero but for rounding; what counts is whether it will rise.
        is_fresh = jnp.any(fresh[:, None] & conditions.reads, axis=0)
        size, rounding = jnp.abs(low.g), TOO_SOON * span * jnp.abs(low.rate)
        is_wrong = (size < jnp.abs(zero)) & ((low.g > 0) != (zero > 0))
        is_zero = (is_fresh & (size < rounding)) | is_wrong
        offset = jnp.where(is_end, jnp.where(is_zero, low.g, 0.0), s.offset)
        rises = jnp.where(rounding > STILL * jnp.abs(zero), low.rate > 0, zero > 0)
        above = jnp.where(is_end, jnp.where(is_zero | (low.g == 0), rises, low.g > 0), s.above)
        low = low._replace(g=low.g - jnp.where(is_end, offset, 0.0))

        def looked() -> Array:
            new = conditions.seen(s.x)
            return ravel_pytree(new._replace(g=new.g - offset))[0]

        flat = jax.lax.cond(s.looks, looked, lambda: s.high)
        new, last = unflat(flat), unflat(jnp.where(is_end, flat, s.end))
        verdict = judged(conditions, length, short, s.count, low, new, above, s.holds, fresh & is_end)
        at_once, passes, is_found = decided_once(
            s.x, is_end & jnp.any(verdict.at_once), is_start | verdict.passes, verdict.is_found
        )
        # What follows an interval in which nothing happens: the rest up to `high`, or the next part of the step.
        part = jnp.minimum(length / PARTS, over(TURN * (last.t - new.t), advance(new, last)))
        onward = jnp.where(is_start, end, new.t + jnp.minimum(part, 0.5 * (last.t - new.t)))
        is_found = at_once | (~passes & is_found)
        ends = is_found | (passes & ~is_start & (new.t >= last.t)) | (s.count > MOST)
        low = ravel_pytree(low)[0]
        return _Search(
            low=jnp.where(passes & ~at_once, flat, low),
            high=jnp.where(at_once, low, jnp.where(passes, jnp.where(s.looks, s.high, s.end), flat)),
            end=jnp.where(is_end, flat, s.end),
            above=jnp.where(passes & ~at_once, verdict.after, above),
            holds=jnp.where(is_start, s.holds, jnp.where(passes & ~at_once, verdict.holds_after, verdict.holds)),
            offset=offset,
            x=jnp.where(passes, onward, verdict.x),
            looks=is_start | ~(passes & s.looks),
            begins=jnp.where(at_once, verdict.at_once, verdict.begins),
            is_found=is_found,
            is_over=ends,
            count=s.count + s.looks,
        )

    begin = _Search(
        low=ravel_pytree(start)[0],
        high=last,
        end=last,
        above=jnp.zeros(start.g.shape, bool),
        holds=holds,
        offset=jnp.zeros_like(start.g),
        x=jnp.where(is_known, end, start.t),
        looks=~no,
        begins=none,
        is_found=no,
        is_over=no,
        count=jnp.where(is_known, 1, 0),
    )
    s = jax.lax.while_loop(lambda s: ~s.is_over, next_point, begin)
    low, high, last = unflat(s.low), unflat(s.high), unflat(s.end)
    last = last._replace(g=last.g + s.offset)
    after = signs(high.g, s.above)
    least = TOO_SOON * span * jnp.maximum(jnp.abs(low.rate), jnp.abs(high.rate))
    # What is zero but for rounding, and has not passed it, is about to pass it or has come from there.
    is_zero = jnp.abs(high.g) < least
    sides = jnp.where(is_zero & (after == s.above), high.rate > 0, after)
    zero = jnp.where(is_zero, sign_of(sides) * least, 0.0)
    without = jnp.where(jnp.abs(high.g - low.g) > least, s.above, sides)
    margins = jnp.stack([sign_of(sides), sign_of(without), high.g], axis=1)
    still = jnp.zeros_like(high.g)
    values, paces = jax.jvp(
        lambda g: conditions.logic(g, -g), (margins,), (jnp.stack([still, still, high.rate], axis=1),)
    )
    begins = (s.begins | conditions.begun(values[:, 0] > 0, s.holds)) & s.is_found
    leaps = begins & ~conditions.begun(values[:, 1] > 0, s.holds) & jnp.any(after != s.above)
    given_up = jnp.where(low.t > start.t + short, low.t, high.t)
    reached = jnp.where(s.is_found | (low.t >= last.t), last.t, given_up)
    pace = jnp.where(jnp.isfinite(paces[:, 2]), paces[:, 2], 0.0)
    return Found(s.is_found, high.t, low.t, pace, high.shift, begins, leaps, sides, zero, s.holds, last, reached)
