"""The largest values that functions of the variables take over a run, and when."""

import dataclasses
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from .._numbers import Numbers
from .field import Given, values_of, wanted_pairs
from .settings import Settings
from .span import Span

NODES = 3  # of a step, at which rates are looked at: each function may turn once between two of them
MOST = 40  # points
CLOSE = 1e-5  # share of a step: so close to a turn, one step of Newton's method leads to it but for rounding


class Peak(NamedTuple):
    """The largest value over a run, and the time at which it is taken."""

    value: Array
    time: Array


class _Turn(NamedTuple):
    """Where functions turn from rising to falling, between `low` and `high`, if they do: it is looked at x next."""

    low: Array
    high: Array
    low_rate: Array
    high_rate: Array
    x: Array
    bend: Array  # the second derivative
    is_open: Array  # whether it is still looked for
    exists: Array
    bound: Array  # no value is larger there
    last: tuple[Any, Any, Any]  # the node before, with values and rates
    count: Any


@dataclasses.dataclass(frozen=True, eq=False)
class Peaks:
    """The functions of which peaks are asked for, and the peaks up to the end of a step.

    Within a step that is where the rate along its dense output vanishes. With the rate r and its slope there,

        t* = t - r / r',    g* = g - r^2 / (2 r'),

    whose derivatives are those of the extremum: by the implicit function theorem, and by the envelope theorem.
    """

    settings: Settings

    def values(self, t: Array, y: Array, given: Given) -> Array:
        """The functions at a point."""
        system, peaks = self.settings.system, self.settings.peaks
        assert peaks is not None
        point = y[self.settings.layout.point]
        store = system.evaluate(t, point, given.inputs, wanted_pairs(system, peaks.leaves))
        values = values_of(system, t, point, given, store, peaks.leaves)
        return jnp.stack(peaks(given.numbers.peaks, [values[leaf] for leaf in peaks.leaves]))

    def begun(self, t: Array, y: Array, given: Given) -> Array:
        """The peaks where a run starts."""
        values = self.values(given.direction * t, y, given)
        return jnp.concatenate([values, jnp.full(len(values), t)])

    def _along(self, t: Array, path: Span, given: Given) -> tuple[Array, Array, Array]:
        """The functions at a time on the path of a step, their rates, and the time as it moves with the step's ends."""

        def values(t: Any) -> tuple[Array, Any]:
            moved, there = path.moving(t)
            return self.values(given.direction * moved, there, given), moved

        (found, moved), (rates, _) = jax.jvp(values, (t,), (jnp.ones_like(t),))
        return found, rates, moved

    def renewed(self, path: Span, end: Numbers, y: Array, given: Given) -> Array:
        """The peaks after a step along a path, which ends at a time with the vector y, that after an event."""
        old, forward = y[self.settings.layout.peaks], given.direction
        best = Peak(*jnp.split(old, 2))

        hold = jax.lax.stop_gradient
        held = hold((path, given))
        turn = _turns(lambda t: self._along(t, *held)[:2], *hold((path.t0, end, best.value)))
        x = jnp.append(turn.x, hold(end))
        found, rates, moved = jax.vmap(lambda t: self._along(t, path, given))(x)
        n = len(turn.x)
        own, rate = jnp.diagonal(found[:n]), jnp.diagonal(rates[:n])
        bend = jnp.where(turn.bend < 0.0, turn.bend, -jnp.inf)
        # At a kink there is no Newton step to make: the rate jumps, and the slope of it is that of some other place.
        is_smooth = jnp.abs(hold(rate / bend)) <= 2.0 * CLOSE * jnp.abs(hold(end) - hold(path.t0))
        bend = jnp.where(is_smooth, bend, -jnp.inf)
        inside = Peak(own - rate**2 / (2.0 * bend), moved[:n] - rate / bend)
        # Up to an event, which moves, the functions change at their rates.
        before = Peak(found[n] + hold(rates[n]) * (end - moved[n]), jnp.full(n, end))
        after = Peak(self.values(forward * end, y, given), jnp.full(n, end))
        for one, counts in ((inside, turn.exists), (before, True), (after, True)):
            is_higher = counts & (one.value > best.value)
            best = Peak(*(jnp.where(is_higher, a, b) for a, b in zip(one, best, strict=True)))
        return jnp.concatenate(best)


def _turns(along: Callable[[Any], tuple[Any, Any]], start: Numbers, end: Numbers, best: Array) -> _Turn:
    """For each function the turn within a step that may lead highest, if any leads beyond the `best` so far."""
    n, width = len(best), end - start

    def look(turn: _Turn) -> _Turn:
        values, rates = jax.vmap(along)(turn.x)
        g, rate = jnp.diagonal(values), jnp.diagonal(rates)
        return jax.lax.cond(turn.count < NODES, _enclosed, _narrowed, turn, g, rate)

    def _enclosed(turn: _Turn, g: Array, rate: Array) -> _Turn:
        """After a look at a node."""
        x, last = turn.x, turn.last
        step = x - last[0]
        turns = (turn.count > 0) & (last[2] > 0.0) & (rate <= 0.0)
        # Tangents meet above whatever bends one way.
        slopes = jnp.where(turns, last[2] - rate, 1.0)
        meet = jnp.where(turns, last[1] + last[2] * (g - last[1] - rate * step) / slopes, -jnp.inf)
        is_better = turns & (meet > turn.bound)
        old = turn.low, turn.high, turn.low_rate, turn.high_rate, turn.bound
        new = last[0], x, last[2], rate, meet
        low, high, low_rate, high_rate, bound = map(lambda a, b: jnp.where(is_better, a, b), new, old)
        exists = turn.exists | is_better
        is_last = turn.count == NODES - 1
        following = jnp.minimum(x + width / (NODES - 1), end)
        secant = low + (high - low) * low_rate / jnp.where(exists, low_rate - high_rate, 1.0)
        return _Turn(
            low, high, low_rate, high_rate, jnp.where(is_last, jnp.where(exists, secant, end), following),
            jnp.where(exists, (high_rate - low_rate) / jnp.where(exists, high - low, 1.0), -1.0),
            exists, exists, bound, (x, g, rate), turn.count + 1,
        )  # fmt: skip

    def _narrowed(turn: _Turn, g: Array, rate: Array) -> _Turn:
        """After a look between low and high."""
        rises = rate > 0.0
        low, high = jnp.where(rises, turn.x, turn.low), jnp.where(rises, turn.high, turn.x)
        low_rate, high_rate = jnp.where(rises, rate, turn.low_rate), jnp.where(rises, turn.high_rate, rate)
        apart = turn.x - turn.last[0]
        slope = (rate - turn.last[2]) / jnp.where(apart == 0.0, 1.0, apart)
        bend = jnp.where(turn.is_open & (apart != 0.0) & (slope < 0.0), slope, turn.bend)
        aim = turn.x - rate / bend
        aim = jnp.where((aim > low) & (aim < high) & (turn.count % 4 != 3), aim, 0.5 * (low + high))
        # The slope of the rate is that between the last two points, which must not be one but for rounding.
        step, least = aim - turn.x, 0.5 * CLOSE * width
        step = jnp.where(jnp.abs(step) < least, jnp.where(step < 0.0, -least, least), step)
        is_open = turn.is_open & (jnp.abs(apart) > CLOSE * width)
        x = jnp.where(is_open, turn.x + step, turn.x)
        last = tuple(jnp.where(turn.is_open, a, b) for a, b in zip((turn.x, g, rate), turn.last, strict=True))
        return _Turn(
            low, high, low_rate, high_rate, x, bend, is_open, turn.exists, turn.bound,
            (last[0], last[1], last[2]), turn.count + 1,
        )  # fmt: skip

    none, nothing = jnp.zeros(n, bool), jnp.zeros(n)
    begin = _Turn(
        nothing, nothing, nothing, nothing, jnp.full(n, start), nothing - 1.0, none, none, best,
        (nothing, nothing, nothing), jnp.asarray(0),
    )  # fmt: skip
    return jax.lax.while_loop(lambda t: (t.count < NODES) | (jnp.any(t.is_open) & (t.count < MOST)), look, begin)
