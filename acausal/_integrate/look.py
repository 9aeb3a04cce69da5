"""The search for the first event within a step."""

from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from .run_events import tick

POINTS = 5  # at which a stretch of time is looked at, its ends among them
MOST = 200  # stretches
SAME = 1e-11  # of the time span: an event does not happen again so soon
Margins: TypeAlias = Callable[[Any], Any]  # at a time


class Found(NamedTuple):
    """`begins` marks the events that happen first, at the time `t`, where `is_any`; just before it, at `before`, they
    do not. `holds` are the conditions that hold at the end of what was looked at.
    """

    is_any: Any
    t: Any
    before: Any
    begins: Any
    holds: Any


class _Stretch(NamedTuple):
    """Where to look next: from `low` to `high`, and then on to the end. `holds` is for `low`."""

    low: Any
    high: Any
    inner: Any  # the times to look at in between
    holds: Any
    offset: Any  # of margins from zero, but for rounding
    begins: Any
    is_found: Any
    goes_on: Any
    count: Any


def look(
    margins: Margins, start: Any, end: Any, holds: Any, fresh: Any, either: np.ndarray, span: Any
) -> Found:
    """The first event on a stretch of the solution whose conditions are `margins`, positive where they are true.

    `holds` are the conditions that hold at the start, and `fresh` those that have just become true: they happen again
    only after they were false. Events that are `either` happen when they become false, too.

    Margins and their rates are taken at five points. Between two of them an event has begun where a margin has changed
    its sign, and may have begun where its rates point at zero from both sides, and the tangents meet beyond it. The
    first such interval is looked at in the same way, until it is as short as rounding permits. So an event is found
    if its margin turns at most once between neighbouring points.
    """

    def both(t: Any) -> tuple[Any, Any]:
        return jax.jvp(margins, (t,), (jnp.ones_like(t),))

    def next_stretch(s: _Stretch) -> _Stretch:
        times = jnp.concatenate([s.low[None], s.inner, s.high[None]])
        g, rate = jax.vmap(both)(times)
        is_first = s.count == 0
        # The margin of an event that has just happened is zero but for rounding.
        is_zero = fresh & is_first & (jnp.abs(g[0]) < SAME * span * jnp.abs(rate[0]))
        offset = jnp.where(is_zero, g[0], s.offset)
        g = g - offset
        held = jnp.where(fresh & is_first, (g[0] > 0) | (is_zero & (rate[0] > 0)), s.holds)
        began = _began(g[0], held, either) & is_first
        states, begun, bumps = [held], [began], [jnp.zeros_like(began)]
        for i in range(1, POINTS):
            begun.append(_began(g[i], states[-1], either))
            bumps.append(_bump(times[i - 1 : i + 1], g[i - 1 : i + 1], rate[i - 1 : i + 1], states[-1]))
            states.append(_goes_on(g[i], states[-1], either))
        begun, bumps, states = jnp.stack(begun), jnp.stack(bumps), jnp.stack(states)
        interesting = jnp.any(begun | bumps, axis=1)
        i = jnp.argmax(interesting)
        a = jnp.maximum(i - 1, 0)
        low, high = times[a], times[i]
        is_short = high - low <= tick(high)
        here = jnp.any(begun[i])
        is_found = interesting[i] & here & is_short
        zooms = interesting[i] & ~is_short
        # What is too short to be looked at any closer, and shows nothing, is passed.
        passed_to = jnp.where(interesting[i], high, times[-1])
        holds = jnp.where(zooms, states[a], jnp.where(interesting[i], states[i], states[-1]))
        low, high = jnp.where(zooms, low, passed_to), jnp.where(zooms, high, end)
        inner = jnp.where(
            zooms,
            _aimed(low, high, g[a], g[i], rate[a], rate[i], states[a], begun[i], bumps[i]),
            _evenly(low, high),
        )
        is_over = ~zooms & (passed_to >= end)
        goes_on = ~is_found & ~is_over & (s.count < MOST)
        return _Stretch(
            jnp.where(is_found, times[a], low), jnp.where(is_found, times[i], high), inner, holds, offset,
            jnp.where(is_found, begun[i], False), is_found, goes_on, s.count + 1,
        )  # fmt: skip

    none = jnp.zeros_like(holds)
    first = _Stretch(
        start, end, _evenly(start, end), holds, jnp.zeros(holds.shape), none, jnp.asarray(False), jnp.asarray(True), jnp.asarray(0)
    )
    last = jax.lax.while_loop(lambda s: s.goes_on, next_stretch, first)
    return Found(last.is_found, last.high, last.low, last.begins, last.holds)


def _evenly(low: Any, high: Any) -> Any:
    return low + (high - low) * np.arange(1, POINTS - 1) / (POINTS - 1)


def _began(g: Any, holds: Any, either: np.ndarray) -> Any:
    return (~holds & (g > 0)) | (either & holds & (g < 0))


def _goes_on(g: Any, holds: Any, either: np.ndarray) -> Any:
    """What of that which held before holds still, where nothing has begun."""
    return jnp.where(either, ~(g < 0), g > 0) & holds


def _bump(times: Any, g: Any, rate: Any, holds: Any) -> Any:
    """Whether a condition may change twice between two times: its rates point at zero, and the tangents meet beyond."""
    q, towards = jnp.where(holds, -g, g), jnp.where(holds, -rate, rate)
    width = times[1] - times[0]
    points = (q[0] <= 0) & (q[1] <= 0) & (towards[0] > 0) & (towards[1] < 0)
    bend = jnp.where(points, towards[0] - towards[1], 1.0)
    meet = (q[1] - q[0] - towards[1] * width) / bend
    return points & (q[0] + towards[0] * meet > 0)


def _aimed(low: Any, high: Any, g0: Any, g1: Any, r0: Any, r1: Any, holds: Any, begins: Any, bumps: Any) -> Any:
    """Times at which to look at an interval: on both sides of where the zero, or the extremum, probably is."""
    width = high - low
    sign = jnp.where(holds, -1.0, 1.0)
    q0, q1, p0, p1 = (sign * x for x in (jnp.where(holds, g0, jnp.minimum(g0, 0.0)), g1, r0, r1))
    rise = q1 - q0
    secant = jnp.where(rise > 0, -q0 / jnp.where(rise > 0, rise, 1.0), 0.5)
    # Where the margin bends one way only, its zero lies between the secant's and that of a tangent.
    tangents = jnp.stack([-_over(q0, p0 * width), 1.0 - _over(q1, p1 * width)])
    guesses = jnp.stack([secant, *jnp.where((tangents > 0) & (tangents < 1), tangents, secant)])
    near, far = jnp.min(guesses, axis=0), jnp.max(guesses, axis=0)
    turn = _over(p0, p0 - p1)
    is_bump = ~jnp.any(begins) | jnp.any(bumps)
    which = jnp.where(is_bump, jnp.argmin(jnp.where(bumps, turn, jnp.inf)), jnp.argmin(jnp.where(begins, near, jnp.inf)))
    apart = tick(high) / width
    beside = jnp.stack([near[which] - apart, far[which] + apart, jnp.asarray(0.5)])
    middles = jnp.stack([0.5 * turn[which], turn[which], 0.5 + 0.5 * turn[which]])
    shares = jnp.where(is_bump, middles, beside)
    shares = jnp.where(jnp.isfinite(shares), jnp.clip(shares, 0.0, 1.0), 0.5)
    return jnp.sort(low + shares * width)


def _over(a: Any, b: Any) -> Any:
    return jnp.where(b != 0, a / jnp.where(b != 0, b, 1.0), jnp.inf)
