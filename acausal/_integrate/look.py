"""The search for the first event within a step."""

import functools as ft
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from .conditions import EventConditions, sign_of, signs

PARTS = 4  # of a step, that are looked at one by one where events may be near
MOST = 200  # points
TOO_SOON = 1e-11  # of the time span: an event does not happen again so soon


class Point(NamedTuple):
    """Margins and their rates at a time."""

    t: Any
    g: Any
    rate: Any


class Found(NamedTuple):
    """`begins` marks the events that happen first, at the time `t`, where `is_any`; just before it, at `before`, they
    do not. Those that `leaps` marks do not come continuously. `holds` are the conditions that hold at the `end` of what
    was looked at.
    """

    is_any: Any
    t: Any
    before: Any
    begins: Any
    leaps: Any
    holds: Any
    end: Point


class _Search(NamedTuple):
    """What comes before `low` is passed, `above` are the relations that hold there, and `holds` the conditions; the
    next event is looked for up to `high`, and if there is none, up to `end`. The margins at x are wanted next: at the
    start, then at the end, then in between.
    """

    low: Point
    high: Point
    end: Point
    above: Any
    holds: Any
    offset: Any
    x: Any
    begins: Any
    is_found: Any
    is_over: Any
    count: Any


class _Verdict(NamedTuple):
    """An interval on which nothing happens `passes`; else the event is found at its end, or one has to look at x."""

    passes: Any
    is_found: Any
    begins: Any
    x: Any


def look(
    conditions: EventConditions, start: Point, is_known: Any, end: Any, holds: Any, fresh: Any, span: Any, short: Any
) -> Found:
    """The first event after `start`, of which all but the time may be unknown.

    `holds` are the conditions that hold at the start, and `fresh` those that have just become true: they happen again
    only after they were false. Times closer than `short` are one and the same, and what happens within a tiny share of
    the `span` of the run is due to rounding.

    Margins of relations and their rates are taken at both ends. Where they are so far from zero that their variation
    over the step does not bring them there, or what else holds makes them idle, that is all; else the step is looked at
    in four parts. On a part a relation has changed where its margin has another sign at the end, and may have changed
    where its rates point at zero from both ends, and the tangents meet beyond it; where a condition becomes true by
    that, or may do so, the part is narrowed down to rounding. So an event is found if each margin turns at most once on
    each part.
    """
    length = end - start.t

    def next_point(s: _Search) -> _Search:
        new = Point(s.x, *jax.jvp(conditions.margins, (s.x,), (jnp.ones_like(s.x),)))
        is_start, is_end = s.count == 0, s.count == 1
        # The margin of an event that has just happened is zero but for rounding; what counts is whether it will rise.
        is_fresh = jnp.any(fresh[:, None] & conditions.reads, axis=0)
        is_zero = is_fresh & (jnp.abs(s.low.g) < TOO_SOON * span * jnp.abs(s.low.rate))
        offset = jnp.where(is_end, jnp.where(is_zero, s.low.g, 0.0), s.offset)
        new = new._replace(g=new.g - offset)
        first = jnp.where(is_zero | (s.low.g == 0), s.low.rate > 0, s.low.g > 0)
        above = jnp.where(is_end, first, s.above)
        holds = jnp.where(is_end & fresh, conditions.true(above), s.holds)
        low = _pick(is_start, new, s.low._replace(g=s.low.g - jnp.where(is_end, offset, 0.0)))
        s = _Search(
            low, _pick(is_end, new, s.high), _pick(is_end, new, s.end), above, holds, offset,
            jnp.where(is_start, end, s.x), s.begins, s.is_found, s.is_over, s.count + 1,
        )  # fmt: skip
        after = signs(new.g, above)
        may_begin = conditions.may_begin(above, above != after, _is_near(low, new, above), holds)
        at_once = conditions.begin(above, holds)
        is_clear = is_end & ~jnp.any(may_begin | at_once)
        passed = s._replace(low=s.end, holds=holds & conditions.true(after), is_over=is_clear)
        return jax.lax.cond(
            is_start | is_clear, lambda: _pick(is_clear, passed, s), lambda: narrowed(s, new, at_once & is_end)
        )

    def narrowed(s: _Search, new: Point, at_once: Any) -> _Search:
        """The search after a look at a point between `low` and `high`."""
        now = jnp.any(at_once)
        above = signs(new.g, s.above)
        holds = s.holds & conditions.true(above)
        judged = jax.vmap(ft.partial(_judged, conditions, length, short, s.count))(
            *_both((s.low, new, s.above, s.holds), (new, s.high, above, holds))
        )
        before, behind = (jax.tree.map(lambda x, i=i: x[i], judged) for i in (0, 1))
        last = signs(s.high.g, above)
        verdict = _pick(before.passes, behind, before)
        low = _pick(before.passes, _pick(behind.passes, s.high, new), s.low)
        high = _pick(verdict.passes, s.end, _pick(before.passes, s.high, new))
        onward = low.t + jnp.minimum(length / PARTS, 0.5 * (s.end.t - low.t))
        is_found = now | verdict.is_found
        at_low = (s.above, s.holds), (above, holds), (last, holds & conditions.true(last))
        above, holds = _pick(before.passes, _pick(behind.passes, at_low[2], at_low[1]), at_low[0])
        return _Search(
            low,
            _pick(now, low, high),
            s.end,
            above,
            holds,
            s.offset,
            jnp.where(verdict.passes, onward, verdict.x),
            jnp.where(now, at_once, verdict.begins),
            is_found,
            is_found | (verdict.passes & (low.t >= s.end.t)) | (s.count > MOST),
            s.count,
        )

    none = jnp.zeros_like(holds)
    last = Point(end, jnp.zeros_like(start.g), jnp.zeros_like(start.g))
    no = jnp.asarray(False)
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
    without = jnp.where(jnp.abs(s.high.g - s.low.g) > least, s.above, after)
    leaps = begins & ~conditions.begin(without, s.holds) & jnp.any(after != s.above)
    return Found(s.is_found, s.high.t, s.low.t, begins, leaps, s.holds, last)


def _both(a: Any, b: Any) -> Any:
    return jax.tree.map(lambda x, y: jnp.stack([x, y]), a, b)


def _pick(condition: Any, a: Any, b: Any) -> Any:
    return jax.tree.map(lambda x, y: jnp.where(condition, x, y), a, b)


def _is_near(low: Point, high: Point, above: Any) -> Any:
    """Which margins may become zero on an interval by as much as they vary there, or are not known; those that are
    infinite at both ends, as at a stop that is infinitely far away, do not.
    """
    sign = -sign_of(above)
    variation = jnp.abs(high.g - low.g) + (high.t - low.t) * (jnp.abs(low.rate) + jnp.abs(high.rate))
    nearest = jnp.maximum(sign * low.g, sign * high.g)
    return ~((nearest + variation < 0) | (nearest == -jnp.inf))


def _judged(
    conditions: EventConditions, length: Any, short: Any, count: Any, low: Point, high: Point, above: Any, holds: Any
) -> _Verdict:
    """What is to be done with the interval from `low`, where these relations and conditions hold, to `high`."""
    width, sign = high.t - low.t, -sign_of(above)
    # Positive beyond the next change, and the rates towards it.
    q0, q1, p0, p1 = sign * low.g, sign * high.g, sign * low.rate, sign * high.rate
    after = signs(high.g, above)
    changes = after != above
    points = (q0 <= 0) & (q1 <= 0) & (p0 > 0) & (p1 < 0)
    bend = jnp.where(points, p0 - p1, 1.0)
    bumps = points & (q0 + p0 * (q1 - q0 - p1 * width) / bend > 0)
    is_part, is_short = PARTS * width <= length * (1.0 + 1e-9), width <= short
    turns = jnp.where(is_part, bumps, _is_near(low, high, above))
    is_likely = jnp.any(conditions.may_begin(above, changes, turns, holds))
    begins = conditions.begin(after, holds)
    happens = jnp.any(begins)
    share = jnp.where(is_part, _aim(jnp.minimum(q0, 0.0), q1, p0, p1, width, changes, bumps, short, count), 0.5)
    return _Verdict(
        ~is_likely | (is_short & ~happens), is_short & happens, begins, low.t + jnp.clip(share, 0.0, 1.0) * width
    )


def _aim(q0: Any, q1: Any, p0: Any, p1: Any, width: Any, changes: Any, bumps: Any, short: Any, count: Any) -> Any:
    """The share of an interval at which to look: by turns before and behind where the zero probably is, or at the
    extremum, and lest that comes no nearer, half-way.
    """
    rise = q1 - q0
    secant = jnp.where(rise > 0, -q0 / jnp.where(rise > 0, rise, 1.0), 0.5)
    # Where the margin bends one way only, its zero lies between the secant's and that of a tangent.
    tangents = jnp.stack([-_over(q0, p0 * width), 1.0 - _over(q1, p1 * width)])
    guesses = jnp.stack([secant, *jnp.where((tangents > 0) & (tangents < 1), tangents, secant)])
    near, far = jnp.min(guesses, axis=0), jnp.max(guesses, axis=0)
    turn = _over(p0, p0 - p1)
    which = jnp.argmin(jnp.where(changes, near, jnp.inf))
    zero = jnp.where(count % 2 == 0, near[which] - short / width, far[which] + short / width)
    share = jnp.where(jnp.any(bumps), jnp.min(jnp.where(bumps, turn, jnp.inf)), zero)
    return jnp.where((count % 5 == 4) | ~jnp.isfinite(share), 0.5, share)


def _over(a: Any, b: Any) -> Any:
    return jnp.where(b != 0, a / jnp.where(b != 0, b, 1.0), jnp.inf)
