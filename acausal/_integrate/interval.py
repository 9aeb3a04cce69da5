"""What the margins at the ends of an interval tell of what happens in between."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import PyTree

from .._numbers import Numbers
from .._reduce.angles import with_angles
from .conditions import EventConditions, sign_of, signs

PARTS = 4  # a step in which events may lie is looked at in this many parts
LOOKS = 2  # evaluations at a time on a path that is corrected: more, with one matrix, would not converge everywhere
TURN = 0.5 * math.pi  # most by which the fastest angle may turn on a part


class Seen(NamedTuple):
    """Margins and the angles that they are computed with, the rates of both at a time, and the sum of the steps of
    stairs on which they are. Where the path is corrected, `shift` is by how much the states are moved, and its rate.
    """

    t: Any
    g: Array
    rate: Array
    angle: Array
    speed: Array
    steps: Any
    shift: tuple[Array, ...] = ()


class Verdict(NamedTuple):
    """What an interval tells. Nothing happens on one that `passes`; else the events that `begins` marks happen at its
    end, if the moment `is_found`, or one has to look at x.

    - `holds`, `at_once`: the conditions that hold at its start, and the events that happen there.
    - `after`, `holds_after`: the relations that hold at its end, and which of the conditions `holds` still do.
    """

    passes: Array
    is_found: Array
    begins: Array
    x: Array
    holds: Array
    at_once: Array
    after: Array
    holds_after: Array


class _Course(NamedTuple):
    """Margins at both ends of an interval and their rates, with signs such that a relation changes where its margin
    becomes positive.
    """

    q0: Array
    q1: Array
    p0: Array
    p1: Array
    width: Numbers

    @property
    def bumps(self) -> Array:
        """Those that may change there and back: their rates point at zero from both ends, and the tangents meet beyond
        it.
        """
        q0, q1, p0, p1, width = self
        points = (q0 <= 0) & (q1 <= 0) & (p0 > 0) & (p1 < 0)
        return points & (q0 + p0 * (q1 - q0 - p1 * width) / jnp.where(points, p0 - p1, 1.0) > 0)

    @property
    def leaps(self) -> Array:
        """Those that a stair, such as floor, may take beyond zero: margins may jump where it steps, and pass zero
        before or after that, so each end is looked at by its own tangent.
        """
        q0, q1, p0, p1, width = self
        return (q0 <= 0) & (q1 <= 0) & ((q0 + p0 * width > 0) | (q1 - p1 * width > 0))


def seen(margins: Callable[[Array], PyTree], t: Numbers) -> Seen:
    """What is there at a time."""
    here, rates = jax.jvp(with_angles(margins), (t,), (jnp.ones_like(t),))
    return Seen(t, here.value, rates.value, here.angles, rates.angles, here.steps)


def seen_on_course(
    values: Callable[[Numbers, Array], tuple[Array, Array]],
    path: Callable[[Array], Array],
    error: Callable[[Array, Array], Array],
    t: Numbers,
) -> Seen:
    """What is there at a time on a path from which `error(t, rates)` is missing, to be added to its states.

    `values` gives the margins and the rates of the states at a point. It is evaluated at one place of the program, on
    the path as it is, and again where this leads to.
    """
    y, slope = jax.jvp(path, (t,), (jnp.ones_like(t),))

    def again(shift: tuple[Array, Array], _: None) -> tuple[tuple[Array, Array], Seen]:
        n = len(shift[0])
        place, pace = (jnp.concatenate([a[:n] + b, a[n:]]) for a, b in zip((y, slope), shift, strict=True))
        here, rates = jax.jvp(with_angles(values), (t, place), (jnp.ones_like(t), pace))
        lacking = jax.jvp(error, (t, here.value[1]), (jnp.ones_like(t), rates.value[1]))
        following = shift[0] + lacking[0], shift[1] + lacking[1]
        return following, Seen(t, here.value[0], rates.value[0], here.angles, rates.angles, here.steps, shift)

    nothing = jnp.zeros(jax.eval_shape(values, t, y)[1].shape)
    _, looks = jax.lax.scan(again, (nothing, nothing), None, length=LOOKS)
    return jax.tree.map(lambda x: x[-1], looks)


def advance(low: Seen, high: Seen) -> Array:
    """By how much the fastest angle turns on an interval: by the difference, and lest it turns there and back, by what
    the rates at both ends agree on.
    """
    turned = (high.t - low.t) * jnp.minimum(jnp.abs(low.speed), jnp.abs(high.speed))
    turned = jnp.maximum(turned, jnp.abs(high.angle - low.angle))
    return jnp.max(jnp.where(jnp.isfinite(turned), turned, 0.0), initial=0.0)


def _may_turn(conditions: EventConditions, low: Seen, high: Seen, above: Array) -> Array:
    """Which margins may be zero in between, though they need not be of another sign at the ends of an interval: those
    that come near zero, and where angles turn fast, all that move.
    """
    return _is_near(low, high, above) | (conditions.moves & (advance(low, high) > TURN))


def _is_near(low: Seen, high: Seen, above: Array) -> Array:
    """Which margins may become zero on an interval by as much as they vary there, or are not known; those that are
    infinite at both ends, as at a stop that is infinitely far away, do not.
    """
    sign = -sign_of(above)
    variation = jnp.abs(high.g - low.g) + (high.t - low.t) * (jnp.abs(low.rate) + jnp.abs(high.rate))
    nearest = jnp.maximum(sign * low.g, sign * high.g)
    return ~((nearest + variation < 0) | (nearest == -jnp.inf))


def judged(
    conditions: EventConditions,
    length: Array,
    short: Numbers,
    count: Array,
    low: Seen,
    high: Seen,
    above: Array,
    holds: Array,
    fresh: Array,
) -> Verdict:
    """What is to be done with the interval from `low`, where these relations and conditions hold, to `high`. Whether
    the `fresh` conditions hold is told by the relations at `low` instead.
    """
    width, turned, sign = high.t - low.t, advance(low, high), -sign_of(above)
    course = _Course(sign * low.g, sign * high.g, sign * low.rate, sign * high.rate, width)
    is_short = width <= short
    is_part = (PARTS * width <= length * (1.0 + 1e-9)) & (turned <= TURN * (1.0 + 1e-6))
    after, bumps = signs(high.g, above) ^ _touches(conditions, low, high), course.bumps
    changes, leaps = after != above, course.leaps & (low.steps != high.steps)
    turns = jnp.where(is_part, bumps | leaps, _may_turn(conditions, low, high, above))
    true, true_after, may_end, may_hold = _told(conditions, above, after, changes | turns)
    holds = jnp.where(fresh, true, holds)
    is_likely = jnp.any(conditions.may_begin(may_end, may_hold, changes + 2 * turns, holds))
    begins = conditions.begun(true_after, holds)
    happens = jnp.any(begins)
    aim = _aim(course._replace(q0=jnp.minimum(course.q0, 0.0)), changes, bumps, short, count)
    share = jnp.where(is_part, aim, jnp.minimum(0.5, over(TURN, turned)))
    return Verdict(
        passes=~is_likely | (is_short & ~happens),
        is_found=is_short & happens,
        begins=begins,
        x=low.t + jnp.clip(share, 0.0, 1.0) * width,
        holds=holds,
        at_once=conditions.begun(true, holds),
        after=after,
        holds_after=holds & true_after,
    )


def _touches(conditions: EventConditions, low: Seen, high: Seen) -> Array:
    """The margins that are zero at the end of an interval, where equations bend: no slope is to be told there, which is
    neither that before nor that behind.
    """
    return (low.g != 0) & (high.g == 0) & conditions.bends


def _told(
    conditions: EventConditions, above: Array, after: Array, may_change: Array
) -> tuple[Array, Array, Array, Array]:
    """Which conditions hold where the relations `above` do, and where those `after` do; and which may fail or hold in
    between, where some relations may change. The logic is evaluated once for all of it, since each place is compiled.
    """
    now, then = sign_of(above), sign_of(after)
    least, most = jnp.where(may_change, -1.0, now), jnp.where(may_change, 1.0, now)
    holds, fails = jnp.stack([now, then, least, most]), -jnp.stack([now, then, most, least])
    first, last, low, high = jax.vmap(conditions.logic)(holds, fails)
    return first > 0, last > 0, low < 0, high > 0


def _aim(course: _Course, changes: Array, bumps: Array, short: Numbers, count: Array) -> Array:
    """The share of an interval at which to look: by turns before and behind where the zero probably is, or at the
    extremum, and lest that comes no nearer, half-way.
    """
    q0, q1, p0, p1, width = course
    rise = q1 - q0
    secant = jnp.where(rise > 0, -q0 / jnp.where(rise > 0, rise, 1.0), 0.5)
    # Where the margin bends one way only, its zero lies between the secant's and that of a tangent.
    tangents = jnp.stack([-over(q0, p0 * width), 1.0 - over(q1, p1 * width)])
    guesses = jnp.stack([secant, *jnp.where((tangents > 0) & (tangents < 1), tangents, secant)])
    near, far = jnp.min(guesses, axis=0), jnp.max(guesses, axis=0)
    turn = over(p0, p0 - p1)
    which = jnp.argmin(jnp.where(changes, near, jnp.inf))
    zero = jnp.where(count % 2 == 0, near[which] - short / width, far[which] + short / width)
    share = jnp.where(jnp.any(bumps), jnp.min(jnp.where(bumps, turn, jnp.inf)), zero)
    return jnp.where((count % 5 == 4) | ~jnp.isfinite(share), 0.5, share)


def over(a: Numbers, b: Array) -> Array:
    return jnp.where(b != 0, a / jnp.where(b != 0, b, 1.0), jnp.inf)
