"""Location of the first event within a step: zero crossings of relations on its dense output."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.flatten_util import ravel_pytree

from ..._compiled_once import truths_compiled_once
from ..._numbers import Numbers
from ..._reduce.event_indicators import Circuit, edges, sign_of
from ..step.interval import MOST, SLACK, TURN, PathSample, advance, over
from .event_time import STILL

PARTS = 4  # number of equal parts of a step at whose ends event indicators near zero are evaluated


class Part(NamedTuple):
    """Values `q` and rates `p` of event indicators at both ends of an interval. Their signs are such that a function
    becomes positive when its relation changes.
    """

    q0: Array
    q1: Array
    p0: Array
    p1: Array
    width: Array

    def bumps(self, band: Array) -> Array:
        """Relations that may change and change back: the tangents at both ends intersect beyond zero and the band."""
        q0, q1, p0, p1, width = self
        q0, q1 = q0 - band, q1 - band
        points = (q0 <= 0) & (q1 <= 0) & (p0 > 0) & (p1 < 0)
        return points & (q0 + p0 * (q1 - q0 - p1 * width) / jnp.where(points, p0 - p1, 1.0) > 0)

    @property
    def leaps(self) -> Array:
        """Event indicators that a stair function, such as floor, may take beyond zero. They may jump, so the tangent
        at each end is tested separately.
        """
        q0, q1, p0, p1, width = self
        return (q0 <= 0) & (q1 <= 0) & ((q0 + p0 * width > 0) | (q1 - p1 * width > 0))

    @property
    def near(self) -> Array:
        """Event indicators that may reach zero, with a variation estimated from values and rates at the ends."""
        q0, q1, p0, p1, width = self
        nearest = jnp.maximum(q0, q1)
        variation = jnp.abs(q1 - q0) + width * (jnp.abs(p0) + jnp.abs(p1))
        return ~((nearest + variation < 0) | (nearest == -jnp.inf))

    def aim(self, changes: Array, bumps: Array, short: Numbers, count: Array) -> Array:
        """Relative position of the next evaluation: alternately just before and just after the estimated zero, or at
        the estimated extremum. Every fifth evaluation is a bisection.
        """
        q0, q1, p0, p1, width = self
        q0 = jnp.minimum(q0, 0.0)
        rise = q1 - q0
        secant = jnp.where(rise > 0, -q0 / jnp.where(rise > 0, rise, 1.0), 0.5)
        # A convex or concave function has its zero between the zeros of the secant and of a tangent.
        tangents = jnp.stack([-over(q0, p0 * width), 1.0 - over(q1, p1 * width)])
        guesses = jnp.stack([secant, *jnp.where((tangents > 0) & (tangents < 1), tangents, secant)])
        near, far = jnp.min(guesses, axis=0), jnp.max(guesses, axis=0)
        which = jnp.argmin(jnp.where(changes, near, jnp.inf))
        zero = jnp.where(count % 2 == 0, near[which] - short / width, far[which] + short / width)
        turn = jnp.min(jnp.where(bumps, over(p0, p0 - p1), jnp.inf))
        share = jnp.where(jnp.any(changes), zero, turn)
        least = jnp.minimum(short / width, 0.5)
        return jnp.clip(jnp.where((count % 5 == 4) | ~jnp.isfinite(share), 0.5, share), least, 1.0 - least)


class Conditions(NamedTuple):
    """The conditions of a run along a step.

    - `sample(t)`: the event indicator of each relation, positive if the relation holds, and its rate.
    - `logic`: the conditions as logical expressions of relations.
    - `either`: conditions that also trigger an event when they become false.
    - `band`: the hysteresis of each event indicator: a relation changes only beyond it.
    - `armed`: relations that have been clearly true or false since they last changed.
    - `clears`, `sets`: relations that may become false, or true, without triggering an event.
    """

    sample: Callable[[Numbers], PathSample]
    logic: Circuit
    either: np.ndarray
    band: Array
    armed: Array
    clears: np.ndarray
    sets: np.ndarray


class Returns(NamedTuple):
    """Relations that an event has turned back: their event indicators have crossed zero, and the event has reversed
    their rates, as at the impact of a ball.

    - `arrival`: the rate at which each relation that begins the last event has crossed zero; 0 for all others.
    - `depth`: the distance of the event indicator from zero after the event, on the side that the relation has
      reached; infinite if the event has not turned it back. It is valid until the relation changes, on the path or in
      an event, or a step without an event resolves the excursion.

    If the indicator comes back to this distance before the relation has changed back, its excursion was within the
    resolution of the relation or of time, and the next event is missed.
    """

    arrival: Array
    depth: Array

    @classmethod
    def none(cls, n: int) -> "Returns":
        return cls(jnp.zeros(n), jnp.full(n, jnp.inf))


class Found(NamedTuple):
    """The first event of a step, if any: it has happened at `t`, but not yet at `before`.

    - `triggered`: the conditions that trigger it; `rates`: the rate of the event indicator of each condition there.
    - `truths`: truths of the relations after t; without an event, at the end of the step.
    - `end`: event indicators at the end of the step.
    - `reached`: time up to which the step has been searched.
    - `returns`: the returns of relations that events have turned back, and `is_missed`: whether one of them happened
      unnoticed.
    """

    is_any: Array
    t: Array
    before: Array
    triggered: Array
    rates: Array
    truths: Array
    shift: tuple[Array, ...]
    end: PathSample | None
    reached: Array
    returns: Returns
    is_missed: Array


class _Search(NamedTuple):
    """State of the search: no event happens before `low`, where the relations have these `truths`. If `narrow`, the
    search is locating the first event between `low` and `high`, where some relations have `crossed`.
    """

    low: Array
    high: Array
    end: Array
    truths: Array
    depth: Array
    crossed: Array
    narrow: Array
    is_sampled: Array
    x: Array
    is_found: Array
    is_over: Array
    count: Any


class _Judged(NamedTuple):
    """Assessment of an interval, the `part`: the relations that change, those that may change and change back, the
    conditions that trigger an event by its end, and whether any condition may do so within it.
    """

    part: Part
    changes: Array
    bumps: Array
    triggered: Array
    may_trigger: Array


class _Step(NamedTuple):
    """The step to search."""

    conditions: Conditions
    end: Numbers
    length: Numbers
    short: Numbers
    arrival: Array
    unflat: Callable[[Array], PathSample]

    def judge(self, low: PathSample, high: PathSample, s: _Search, truths: Array) -> _Judged:
        conditions = self.conditions
        sign = -sign_of(truths)
        part = Part(sign * low.g, sign * high.g, sign * low.rate, sign * high.rate, high.t - low.t)
        # A function that an event has left beyond zero by rounding has not crossed unless it moves on.
        changes = (part.q1 > conditions.band) | (s.crossed & (part.q1 > jnp.maximum(part.q0, 0.0)))
        turned = advance(low, high)
        is_part = (PARTS * part.width <= self.length * (1.0 + SLACK)) & (turned <= TURN * (1.0 + SLACK))
        varies = (part.p0 != 0) | (part.p1 != 0) | (low.steps != high.steps)
        turns = part.near | (varies & (turned > TURN))
        turning = part.bumps(conditions.band) | (part.leaps & (low.steps != high.steps))
        bumps = ~changes & jnp.where(is_part, turning, turns)
        triggered, may_trigger = _triggered(conditions, truths, changes, bumps)
        return _Judged(part, changes, bumps, triggered, may_trigger)

    def next_point(self, s: _Search) -> _Search:
        conditions, end, short, unflat = self.conditions, self.end, self.short, self.unflat
        is_start, is_end = s.count == 0, s.count == 1
        low = unflat(s.low)
        flat_new = jax.lax.cond(s.is_sampled, lambda: s.high, lambda: _flat(conditions.sample(s.x)))
        flat_last = jnp.where(is_end, flat_new, s.end)
        new, last = unflat(flat_new), unflat(flat_last)
        truths = jnp.where(is_start, _leaving(conditions, s.truths, new), s.truths)
        sign = sign_of(truths)
        is_turned = is_start & (self.arrival > 0) & (sign * new.rate < -STILL * self.arrival)
        depth = jnp.where(is_turned, sign * new.g, s.depth)
        part, changes, bumps, triggered, may_trigger = self.judge(low, new, s, truths)
        is_short = part.width <= short
        passes, is_found = truths_compiled_once(
            s.x,
            ~is_start & (~may_trigger | (is_short & ~jnp.any(triggered))),
            ~is_start & is_short & jnp.any(triggered),
        )
        is_last = passes & (new.t >= last.t)
        aim = low.t + part.width * part.aim(changes, bumps, short, s.count)
        # Continue after an interval without events: at the end of the narrowed part, or of the next part of the step.
        is_behind = passes & s.narrow & ~s.is_sampled
        is_first_look = is_end & ~passes & ~is_found  # the whole step is undecided: examine its parts
        node = jax.tree.map(lambda a, b: jnp.where(is_first_look, a, b), low, new)
        width = jnp.minimum(self.length / PARTS, over(TURN * (last.t - node.t), advance(node, last)))
        onward = jnp.minimum(node.t + width, last.t)
        x = jnp.where(is_start, end, jnp.where(is_first_look | passes, onward, aim))
        narrows = ~is_start & ~passes & ~is_first_look
        return _Search(
            low=jnp.where(is_start | passes, flat_new, s.low),
            high=jnp.where(narrows, flat_new, s.high),
            end=flat_last,
            truths=jnp.where(passes, truths ^ changes, truths),
            depth=jnp.where(passes & changes, jnp.inf, depth),
            crossed=jnp.where(narrows, s.crossed | changes, s.crossed & ~changes & (is_behind | ~passes)),
            narrow=narrows | is_behind,
            is_sampled=is_behind,
            x=x,
            is_found=is_found,
            is_over=is_found | is_last | (s.count > MOST),
            count=s.count + ~s.is_sampled,
        )


def first_crossing(
    conditions: Conditions,
    start: PathSample,
    is_known: Array,
    truths: Array,
    returns: Returns,
    end: Numbers,
    short: Numbers,
    goes: Array,
) -> Found:
    """The first event of a step from `start` to `end`; `truths` are those of the relations at its start.

    A relation changes if its event indicator has the opposite sign and is beyond its band. The search evaluates the
    event indicators at the end of the step, and if one may reach zero, at the ends of the parts of the step. There
    are four parts, or more if a phase, the argument of a sine, changes by more than a quarter turn in one: while the
    states rest, steps are longer than the periods of such functions. On each part a relation may change once, or change
    and change back if its function is convex or concave. Changes that trigger an event are located to within `short`;
    other changes only update the truths. Relations that cross within their bands at one time change together.

    If `is_known`, the values of `start` are valid; otherwise they are evaluated again. Unless `goes`, as in a rejected
    step, there is no search.
    """
    no, none = jnp.asarray(False), jnp.zeros(start.g.shape, bool)
    flat_start, unflat = ravel_pytree(start)
    flat_end = _flat(start._replace(t=end))
    search = _Search(
        low=flat_start, high=flat_end, end=flat_end, truths=truths, depth=returns.depth, crossed=none, narrow=no,
        is_sampled=no, x=jnp.where(is_known, end, start.t), is_found=no, is_over=~goes,
        count=jnp.where(is_known, 1, 0),
    )  # fmt: skip
    step = _Step(conditions, end, end - start.t, short, returns.arrival, unflat)
    s = jax.lax.while_loop(lambda s: ~s.is_over, step.next_point, search)
    low, high, last = unflat(s.low), unflat(s.high), unflat(s.end)
    sign = -sign_of(s.truths)
    changes = (sign * high.g > 0) | (jnp.abs(high.g) <= conditions.band)
    after = s.truths ^ (s.crossed & changes & s.is_found)
    logic = conditions.logic
    triggered = edges(logic.hold(after), logic.hold(s.truths), conditions.either)
    rates = jax.jvp(lambda g: logic(g, -g), (high.g,), (high.rate,))[1]
    is_over = goes & (s.is_found | (low.t >= end))
    beyond = sign_of(after) * jnp.where(s.is_found, high.g, last.g)
    changed = after ^ s.truths
    is_beyond = is_over & ~changed & (beyond > conditions.band)
    arrival = jnp.where(changed, sign_of(after) * high.rate, 0.0)
    return Found(
        is_any=s.is_found,
        t=high.t,
        before=low.t,
        triggered=triggered & s.is_found,
        rates=jnp.where(jnp.isfinite(rates), rates, 0.0),
        truths=after,
        shift=high.shift[:1] + low.shift[1:],
        end=last,
        reached=jnp.where(s.is_found | (low.t >= end) | ~goes, end, low.t),
        returns=Returns(arrival, jnp.where(changed | (is_beyond & ~s.is_found), jnp.inf, s.depth)),
        is_missed=jnp.any(is_beyond & (beyond > s.depth)),
    )


def _flat(sample: PathSample) -> Array:
    return ravel_pytree(sample)[0]


def _leaving(conditions: Conditions, truths: Array, start: PathSample) -> Array:
    """The truths at the start of a step after an event. If an event indicator is within its band, its rate decides
    the truth of a relation that may change without triggering an event. Others change only beyond the band, and so do
    relations that have just changed.
    """
    is_zero = (jnp.abs(start.g) <= conditions.band) & conditions.armed
    falls = is_zero & (start.rate < 0) & conditions.clears
    rises = is_zero & (start.rate > 0) & conditions.sets
    return (truths & ~falls) | rises


def _triggered(conditions: Conditions, truths: Array, changes: Array, bumps: Array) -> tuple[Array, Array]:
    """The conditions that trigger an event by the end of an interval on which the relations `changes` change, and
    whether any may do so within it, if the relations `bumps` change and change back. One batch evaluates the logic for
    all of this, because each call site is compiled.
    """
    now, then, moves = sign_of(truths), sign_of(truths ^ changes), changes | bumps
    least, most = jnp.where(moves, -1.0, now), jnp.where(moves, 1.0, now)
    holds, fails = jnp.stack([now, then, least, most]), -jnp.stack([now, then, most, least])
    first, last, low, high = jax.vmap(conditions.logic)(holds, fails)
    before, may_end, may_hold = first > 0, low < 0, high > 0
    triggered = edges(last > 0, before, conditions.either)
    may_trigger = (~before & may_hold) | (before & may_end & (conditions.either | jnp.any(bumps)))
    return triggered, jnp.any(triggered) | jnp.any(may_trigger)
