"""The largest values that functions of the variables take over a run, and when."""

import dataclasses
import functools as ft
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from ..._evaluate.groups import Store
from ..._numbers import Numbers
from ..events.turns import Turn, highest_turns
from ..setup.field import Given, values_of, wanted_pairs
from ..setup.settings import Settings
from ..setup.user_function import UserFunction
from ..step.course import share
from ..step.interval import LOOKS, Seen, seen, seen_on_course
from ..step.span import Span

DERIVATIVES = 2  # orders of differentiation that are right, each of which takes a step of Newton's method


class Peak(NamedTuple):
    """The largest value over a run, and the time at which it is taken."""

    value: Array
    time: Array


@dataclasses.dataclass(frozen=True, eq=False)
class Peaks:
    """The functions of which peaks are asked for, and the peaks up to the end of a step.

    Within a step that is where the rate along its dense output vanishes. With the rate r and its slope there,

        t* = t - r / r',    g* = g - r^2 / (2 r'),

    a step of Newton's method, whose derivatives are those of the extremum: by the implicit function theorem, and by the
    envelope theorem. A kink is where the tangents from both sides meet. A second step, from points that move as the
    first one says, has second derivatives, too.
    """

    settings: Settings

    @property
    def _function(self) -> UserFunction:
        assert self.settings.peaks is not None
        return self.settings.peaks

    def values(self, t: Array, y: Array, given: Given) -> Array:
        """The functions at a point."""
        system, point = self.settings.system, y[self.settings.layout.point]
        store = system.evaluate(t, point, given.inputs, wanted_pairs(system, self._function.leaves))
        return self._values(t, point, given, store)

    def _values_and_rates(self, given: Given, t: Numbers, y: Array) -> tuple[Array, Array]:
        """The same and the rates of the states, in the time of the solver."""
        system, point, forward = self.settings.system, y[self.settings.layout.point], given.direction
        wanted = wanted_pairs(system, self._function.leaves)
        rates, store = system.vector_field_and_store(forward * t, point, given.inputs, wanted)
        return self._values(forward * t, point, given, store), forward * rates

    def _values(self, t: Numbers, point: Array, given: Given, store: Store) -> Array:
        peaks = self._function
        values = values_of(self.settings.system, t, point, given.inputs, store, peaks.leaves)
        return jnp.stack(peaks(given.numbers.peaks, [values[leaf] for leaf in peaks.leaves]))

    def _seen(self, path: Span, given: Given, t: Numbers) -> Seen:
        """The functions at a time on the path of a step."""
        if path.course is None:
            return seen(lambda t: self.values(given.direction * t, path.plain(t), given), t)
        error = ft.partial(path.course.error_at, path.inner)
        return seen_on_course(ft.partial(self._values_and_rates, given), path.plain, error, t)._replace(shift=())

    def begun(self, t: Array, y: Array, given: Given) -> Array:
        """The peaks where a run starts."""
        values = self.values(given.direction * t, y, given)
        return jnp.concatenate([values, jnp.full(len(values), t)])

    def _along(self, t: Array, path: Span, given: Given) -> tuple[Array, Array]:
        """The functions at a place on the path of a step, and their rates."""
        held = jax.lax.stop_gradient(path.inner)

        def values(t: Array) -> Array:
            moved, there = path.moving(t)
            course, theta = path.course, share(held, t)
            if course is None:
                return self.values(given.direction * moved, there, given)

            def again(shift: Array, _: None) -> tuple[Array, Array]:
                found, rates = self._values_and_rates(given, moved, course.moved(there, shift))
                return shift + course.error(path.inner, theta, rates), found

            nothing = jnp.zeros(self.settings.layout.n_states)
            return jax.lax.scan(again, nothing, None, length=LOOKS + 1)[1][-1]  # once more for derivatives

        return jax.jvp(values, (t,), (jnp.ones_like(t),))

    def renewed(self, path: Span, end: Numbers, y: Array, given: Given) -> Array:
        """The peaks after a step along a path, which ends at a time with the vector y, that after an event."""
        old, forward = y[self.settings.layout.peaks], given.direction
        best = Peak(*jnp.split(old, 2))

        hold = jax.lax.stop_gradient
        held_path, held = hold((path, given))
        turn = highest_turns(ft.partial(self._seen, held_path, held), *hold((path.t0, end, best.value)))
        n = len(best.value)
        last = jnp.ravel(path.place(end))

        def again(shift: Array, _: None) -> tuple[Array, tuple[Peak, Array]]:
            x = jnp.concatenate([turn.low + shift, turn.high + shift, last])
            found, rates = jax.vmap(lambda t: self._along(t, path, given))(x)
            low, high = ((_own(found[part]), _own(rates[part]), x[part]) for part in (slice(n), slice(n, 2 * n)))
            top = _extremum(turn, low, high)
            # Zero, but it moves with the extremum.
            return jnp.where(turn.exists, top.time - hold(top.time), 0.0), (top, found[-1])

        tops, ends = jax.lax.scan(again, jnp.zeros(n), None, length=DERIVATIVES)[1]
        inside = Peak(tops.value[-1], jnp.asarray(path.moved(tops.time[-1])))
        before = Peak(ends[-1], jnp.full(n, end))
        after = Peak(self.values(forward * end, y, given), jnp.full(n, end))
        for one, counts in ((inside, turn.exists), (before, True), (after, True)):
            is_higher = counts & (one.value > best.value)
            best = Peak(*(jnp.where(is_higher, a, b) for a, b in zip(one, best, strict=True)))
        return jnp.concatenate(best)


def _own(part: Array) -> Array:
    """The diagonal of [functions, places]: each function at the place of its own peak."""
    return jnp.diagonal(part)


def _extremum(turn: Turn, low: tuple[Array, Array, Array], high: tuple[Array, Array, Array]) -> Peak:
    """The peaks between two times, from the values and rates at both."""
    (g, rate, t), (g_high, rate_high, t_high) = low, high
    bend = jnp.where(turn.bend < 0.0, turn.bend, -jnp.inf)
    smooth = Peak(g - rate**2 / (2.0 * bend), t - rate / bend)
    fall = rate - rate_high
    ahead = (g_high - g - rate_high * (t_high - t)) / jnp.where(turn.is_smooth | (fall == 0.0), 1.0, fall)
    kink = Peak(g + rate * ahead, t + ahead)
    return Peak(*(jnp.where(turn.is_smooth, a, b) for a, b in zip(smooth, kink, strict=True)))
