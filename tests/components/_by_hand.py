"""Reference solution of a mass with dry friction between stops: integrated mode by mode with scipy."""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

LOW, HIGH, V_REST = -0.4, 0.6, 0.02
SOON = 1e-9  # s: zeros sooner than that are those at the start


class Shaken(NamedTuple):
    """Parameters of a mass that starts at 0 with the speed v and is pushed by push + amplitude sin(2 pi f t).

    It slides with level + excess exp(-fexp |v|) + viscous |v|, and breaks away at level + excess.
    """

    m: Any
    v: Any
    push: Any
    amplitude: Any
    f: Any
    level: Any
    excess: Any
    fexp: Any
    viscous: Any
    e: Any  # restitution of rigid stops
    c: Any  # stiffness of compliant ones
    d: Any  # and their damping

    def force(self, t: float) -> float:
        return self.push + self.amplitude * math.sin(2.0 * math.pi * self.f * t)

    def spring(self, s: float) -> float:
        return -self.c * (s - HIGH if s > HIGH else min(s - LOW, 0.0))

    def contact(self, s: float, v: float) -> float:
        """Force of compliant stops; the damping neither pulls nor more than doubles it."""
        size = abs(self.spring(s))
        return self.spring(s) - min(max(self.d * v, -size), size)

    def friction(self, speed: float) -> float:
        return self.level + self.excess * math.exp(min(-self.fexp * speed, 1.0)) + self.viscous * speed


class End(NamedTuple):
    """Final state, sliding distance, and events with their times: it (s)ticks, (b)reaks away, (t)urns, (r)ebounds or
    (l)ands at a stop.
    """

    s: float
    v: float
    slid: float
    happened: str
    times: list[float]


def followed(case: Shaken, end: float, *, is_rigid: bool) -> End:
    """The motion up to the time `end`."""
    case = Shaken(*map(float, case))  # with which Python is faster than with numbers of numpy
    t, s, v, slid = 0.0, 0.0, case.v, 0.0
    way, happened, times = np.sign(v), "", list[float]()
    peak = case.level + case.excess
    while t < end:
        if way == 0.0:
            wall = 0.0 if is_rigid else case.spring(s)
            at, levels = s if is_rigid else 0.0, (peak - wall, -peak - wall)
            t, way, what = *_break_away(case.force, t, end, levels, at), "b"
        else:
            t, place, v, what = _slide(case, t, end, s, v, way, is_rigid)
            s, slid = (HIGH if way > 0.0 else LOW) if what == "r" else place, slid + abs(place - s)
            pushed = case.force(t) + (0.0 if is_rigid else case.spring(s))
            if what == "s" and abs(pushed) > peak:
                what, way, v = "t", -way, 0.0
            elif what == "r" and case.e * abs(v) > V_REST:
                way, v = -way, -case.e * v
            elif what:
                what, way, v = "l" if what == "r" else what, 0.0, 0.0
        if t < end:
            happened, times = happened + what, [*times, t]
    return End(s, v, slid, happened, times)


def _break_away(
    force: Callable[[float], float], t: float, end: float, levels: tuple[float, float], s: float
) -> tuple[float, float]:
    """Time and direction of the first break-away."""
    grid = np.linspace(t, end, 2000)
    for a, b in pairwise(grid):
        for way, level, is_open in ((1.0, levels[0], s < HIGH), (-1.0, levels[1], s > LOW)):
            margin = lambda x, level=level, way=way: way * (force(x) - level)  # noqa: E731
            if is_open and margin(b) > 0.0:
                return (a if margin(a) >= 0.0 else float(np.asarray(brentq(margin, a, b, xtol=1e-14)))), way
    return end, 0.0


def _slide(
    case: Shaken, t: float, end: float, s: float, v: float, way: float, is_rigid: bool
) -> tuple[float, float, float, str]:
    """Slides in one direction to a stop or to rest, restarting at each kink; returns also the cause, "" at the end."""

    def rates(t: float, y: Any) -> list[float]:
        wall = 0.0 if is_rigid else case.contact(y[0], y[1])
        return [y[1], (case.force(t) + wall - way * case.friction(way * y[1])) / case.m]

    def solved(end: float, *kinks: Any) -> Any:
        start = t
        rests: Any = lambda t, y: way * y[1] if t > start + SOON else 1.0  # noqa: E731
        hits: Any = lambda t, y: way * (y[0] - (HIGH if way > 0.0 else LOW)) if is_rigid else -1.0  # noqa: E731
        rests.terminal, rests.direction, hits.terminal, hits.direction = True, -1.0, True, 1.0
        return solve_ivp(
            rates,
            (t, end),
            [s, v],
            events=[rests, hits, *kinks],
            max_step=0.004,
            method="DOP853",
            rtol=1e-11,
            atol=1e-13,
        )

    kinks: Any = (
        lambda t, y: y[0] - HIGH,
        lambda t, y: y[0] - LOW,
        lambda t, y: case.d * y[1] - case.spring(y[0]),
        lambda t, y: case.d * y[1] + case.spring(y[0]),
    )
    for kink in kinks:
        kink.terminal = 2  # not at the one at which it starts
    while True:
        out = solved(end, *([] if is_rigid else kinks))
        bent = [x for found in out.t_events[2:] for x in found if t + SOON < x < out.t[-1] - SOON]
        if bent:
            out = solved(min(bent))
        t, s, v = float(out.t[-1]), *map(float, out.y[:, -1])
        what = "s" if len(out.t_events[0]) else "r" if len(out.t_events[1]) else ""
        if what or t == end:
            return t, s, v, what
