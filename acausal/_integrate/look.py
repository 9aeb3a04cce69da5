"""The search for the first event within a step."""

import functools as ft
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import PyTree

from .._numbers import Numbers
from .conditions import EventConditions, sign_of, signs
from .interval import PARTS, TURN, Seen, Verdict, advance, judged, may_turn, over

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
    `high`, and if there is none, up to `end`. The next point to be looked at is x: the start, then the end, then points
    in between.
    """

    low: Seen
    high: Seen
    end: Seen
    above: Array
    holds: Array
    offset: Array
    x: Array
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

    def next_point(s: _Search) -> _Search:
        new = conditions.seen(s.x)
        is_start, is_end = s.count == 0, s.count == 1
        # The margin of an event that has just happened is zero but for rounding; what counts is whether it will rise.
        is_fresh = jnp.any(fresh[:, None] & conditions.reads, axis=0)
        size, rounding = jnp.abs(s.low.g), TOO_SOON * span * jnp.abs(s.low.rate)
        is_wrong = (size < jnp.abs(zero)) & ((s.low.g > 0) != (zero > 0))
        is_zero = (is_fresh & (size < rounding)) | is_wrong
        offset = jnp.where(is_end, jnp.where(is_zero, s.low.g, 0.0), s.offset)
        new = new._replace(g=new.g - offset)
        rises = jnp.where(rounding > STILL * jnp.abs(zero), s.low.rate > 0, zero > 0)
        first = jnp.where(is_zero | (s.low.g == 0), rises, s.low.g > 0)
        above = jnp.where(is_end, first, s.above)
        true = conditions.true(above)
        holds = jnp.where(is_end & fresh, true, s.holds)
        low = _pick(is_start, new, s.low._replace(g=s.low.g - jnp.where(is_end, offset, 0.0)))
        s = _Search(
            low, _pick(is_end, new, s.high), _pick(is_end, new, s.end), above, holds, offset,
            jnp.where(is_start, end, s.x), s.begins, s.is_found, s.is_over, s.count + 1,
        )  # fmt: skip
        after = signs(new.g, above)
        may_begin = conditions.may_begin(above, above != after, may_turn(conditions, low, new, above), holds)
        at_once = conditions.begun(true, holds)
        is_clear = is_end & ~jnp.any(may_begin | at_once)
        passed = s._replace(low=s.end, holds=holds & conditions.true(after), is_over=is_clear)
        return jax.lax.cond(
            is_start | is_clear, lambda: _pick(is_clear, passed, s), lambda: narrowed(s, new, at_once & is_end)
        )

    def narrowed(s: _Search, new: Seen, at_once: Array) -> _Search:
        """The search after a look at a point between `low` and `high`."""
        above = signs(new.g, s.above)
        holds = s.holds & conditions.true(above)
        verdicts = jax.vmap(ft.partial(judged, conditions, length, short, s.count))(
            *_both((s.low, new, s.above, s.holds), (new, s.high, above, holds))
        )
        before, behind = (jax.tree.map(lambda x, i=i: x[i], verdicts) for i in (0, 1))

        def at_once_found() -> _Search:
            return s._replace(high=s.low, begins=at_once, is_found=~no, is_over=~no)

        def between(low: Seen, high: Seen, above: Array, holds: Array, verdict: Verdict) -> _Search:
            return s._replace(
                low=low, high=high, above=above, holds=holds, x=verdict.x, begins=verdict.begins,
                is_found=verdict.is_found, is_over=verdict.is_found | (s.count > MOST),
            )  # fmt: skip

        def onward() -> _Search:
            """The next part, where nothing happens up to `high`."""
            low, last = s.high, signs(s.high.g, above)
            part = jnp.minimum(length / PARTS, over(TURN * (s.end.t - low.t), advance(low, s.end)))
            x = low.t + jnp.minimum(part, 0.5 * (s.end.t - low.t))
            is_over = (low.t >= s.end.t) | (s.count > MOST)
            true = holds & conditions.true(last)
            return s._replace(low=low, high=s.end, above=last, holds=true, x=x, begins=none, is_over=is_over)

        case = jnp.where(jnp.any(at_once), 0, jnp.where(~before.passes, 1, jnp.where(~behind.passes, 2, 3)))
        return jax.lax.switch(
            case,
            [
                at_once_found,
                lambda: between(s.low, new, s.above, s.holds, before),
                lambda: between(new, s.high, above, holds, behind),
                onward,
            ],
        )

    last = start._replace(t=end)
    begin = _Search(
        low=start,
        high=last,
        end=last,
        above=jnp.zeros(start.g.shape, bool),
        holds=holds,
        offset=jnp.zeros_like(start.g),
        x=jnp.where(is_known, end, start.t),
        begins=none,
        is_found=no,
        is_over=no,
        count=jnp.where(is_known, 1, 0),
    )
    s = jax.lax.while_loop(lambda s: ~s.is_over, next_point, begin)
    last = s.end._replace(g=s.end.g + s.offset)
    begins = s.begins & s.is_found
    after = signs(s.high.g, s.above)
    least = TOO_SOON * span * jnp.maximum(jnp.abs(s.low.rate), jnp.abs(s.high.rate))
    # What is zero but for rounding, and has not passed it, is about to pass it or has come from there.
    is_zero = jnp.abs(s.high.g) < least
    sides = jnp.where(is_zero & (after == s.above), s.high.rate > 0, after)
    zero = jnp.where(is_zero, sign_of(sides) * least, 0.0)
    begins |= conditions.begin(sides, s.holds) & s.is_found
    without = jnp.where(jnp.abs(s.high.g - s.low.g) > least, s.above, sides)
    leaps = begins & ~conditions.begin(without, s.holds) & jnp.any(after != s.above)
    given_up = jnp.where(s.low.t > start.t + short, s.low.t, s.high.t)
    reached = jnp.where(s.is_found | (s.low.t >= s.end.t), s.end.t, given_up)
    _, pace = jax.jvp(lambda g: conditions.logic(g, -g), (s.high.g,), (s.high.rate,))
    pace = jnp.where(jnp.isfinite(pace), pace, 0.0)
    return Found(s.is_found, s.high.t, s.low.t, pace, s.high.shift, begins, leaps, sides, zero, s.holds, last, reached)


def _both(a: PyTree, b: PyTree) -> PyTree:
    return jax.tree.map(lambda x, y: jnp.stack([x, y]), a, b)


def _pick(condition: Array, a: PyTree, b: PyTree) -> PyTree:
    return jax.tree.map(lambda x, y: jnp.where(condition, x, y), a, b)
