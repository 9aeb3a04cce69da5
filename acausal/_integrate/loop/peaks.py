"""Maxima of functions of the variables over a run, and their times."""

import dataclasses
import functools as ft
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from ..._evaluate.groups import Segments
from ..._numbers import Numbers
from ..events.turns import Turn, highest_turns
from ..setup.field import RunArgs, values_of, wanted_pairs
from ..setup.settings import Settings
from ..setup.user_function import UserFunction
from ..step.correction import share
from ..step.interval import EVALUATIONS, PathSample, corrected_sample, sample
from ..step.span import Span

DERIVATIVES = 2  # highest correct order of differentiation; each order takes one Newton step


class Peak(NamedTuple):
    """The largest value over a run, and its time."""

    value: Array
    time: Array


@dataclasses.dataclass(frozen=True, eq=False)
class Peaks:
    """The functions with requested peaks, and their peaks up to the end of a step.

    A maximum within a step is a zero of the rate along the dense output. With the rate r and its slope r' close to it,

        t* = t - r / r',    g* = g - r^2 / (2 r')

    is a Newton step. Its derivatives are those of the extremum, by the implicit function theorem and the envelope
    theorem. A kink is the intersection of the tangents from both sides. A second Newton step, from points that move
    with the result of the first one, also has the correct second derivatives.
    """

    settings: Settings

    @property
    def _function(self) -> UserFunction:
        assert self.settings.peaks is not None
        return self.settings.peaks

    def values(self, t: Array, y: Array, args: RunArgs) -> Array:
        """The functions at a point."""
        system, point = self.settings.system, y[self.settings.layout.point]
        store = system.evaluate(t, point, args.inputs, wanted_pairs(system, self._function.leaves))
        return self._values(t, point, args, store)

    def _values_and_rates(self, args: RunArgs, t: Numbers, y: Array) -> tuple[Array, Array]:
        """The functions and the rates of the states at a point, in the time of the solver."""
        system, point, forward = self.settings.system, y[self.settings.layout.point], args.forward
        wanted = wanted_pairs(system, self._function.leaves)
        rates, store = system.vector_field_and_store(forward * t, point, args.inputs, wanted)
        return self._values(forward * t, point, args, store), forward * rates

    def _values(self, t: Numbers, point: Array, args: RunArgs, store: Segments) -> Array:
        peaks = self._function
        values = values_of(self.settings.system, t, point, args.inputs, store, peaks.leaves)
        return jnp.stack(peaks(args.numbers.peaks, [values[leaf] for leaf in peaks.leaves]))

    def _sample(self, path: Span, args: RunArgs, t: Numbers) -> PathSample:
        """The functions, their rates and phases at a time on the path of a step."""
        if path.correction is None:
            return sample(lambda t: self.values(args.forward * t, path.plain(t), args), t)
        error = ft.partial(path.correction.error_at, path.inner)
        return corrected_sample(ft.partial(self._values_and_rates, args), path.plain, error, t)._replace(shift=())

    def at_start(self, t: Array, y: Array, args: RunArgs) -> Array:
        """The peaks at the start of a run."""
        values = self.values(args.forward * t, y, args)
        return jnp.concatenate([values, jnp.full(len(values), t)])

    def _along(self, t: Array, path: Span, args: RunArgs) -> tuple[Array, Array]:
        """The functions and their rates at a position on the path of a step."""
        held = jax.lax.stop_gradient(path.inner)

        def values(t: Array) -> Array:
            moved, there = path.moving_point(t)
            correction, theta = path.correction, share(held, t)
            if correction is None:
                return self.values(args.forward * moved, there, args)

            def again(shift: Array, _: None) -> tuple[Array, Array]:
                found, rates = self._values_and_rates(args, moved, correction.shifted(there, shift))
                return shift + correction.error(path.inner, theta, rates), found

            nothing = jnp.zeros(self.settings.layout.n_states)
            # One more evaluation for derivatives.
            return jax.lax.scan(again, nothing, None, length=EVALUATIONS + 1)[1][-1]

        return jax.jvp(values, (t,), (jnp.ones_like(t),))

    def renewed(self, path: Span, end: Numbers, y: Array, args: RunArgs) -> Array:
        """The peaks after a step along a path to the time `end`; y is the vector there after the events."""
        old, forward = y[self.settings.layout.peaks], args.forward
        best = Peak(*jnp.split(old, 2))

        held_path, held_args = jax.lax.stop_gradient((path, args))
        held_ends = jax.lax.stop_gradient((path.t0, end, best.value))
        turn = highest_turns(ft.partial(self._sample, held_path, held_args), *held_ends)
        n = len(best.value)
        last = jnp.ravel(path.fixed_time(end))

        def again(shift: Array, _: None) -> tuple[Array, tuple[Peak, Array]]:
            x = jnp.concatenate([turn.low + shift, turn.high + shift, last])
            found, rates = jax.vmap(lambda t: self._along(t, path, args))(x)
            low, high = ((_own(found[part]), _own(rates[part]), x[part]) for part in (slice(n), slice(n, 2 * n)))
            top = _extremum(turn, low, high)
            # Zero, with the derivatives of the time of the extremum.
            return jnp.where(turn.exists, top.time - jax.lax.stop_gradient(top.time), 0.0), (top, found[-1])

        tops, ends = jax.lax.scan(again, jnp.zeros(n), None, length=DERIVATIVES)[1]
        inside = Peak(tops.value[-1], jnp.asarray(path.moving_time(tops.time[-1])))
        before = Peak(ends[-1], jnp.full(n, end))
        after = Peak(self.values(forward * end, y, args), jnp.full(n, end))
        for one, counts in ((inside, turn.exists), (before, True), (after, True)):
            is_higher = counts & (one.value > best.value)
            best = Peak(*(jnp.where(is_higher, a, b) for a, b in zip(one, best, strict=True)))
        return jnp.concatenate(best)


def _own(part: Array) -> Array:
    """The diagonal of [functions, positions]: each function at the position of its own peak."""
    return jnp.diagonal(part)


def _extremum(turn: Turn, low: tuple[Array, Array, Array], high: tuple[Array, Array, Array]) -> Peak:
    """The peaks between two times, from the values and rates at both times."""
    (g, rate, t), (g_high, rate_high, t_high) = low, high
    bend = jnp.where(turn.bend < 0.0, turn.bend, -jnp.inf)
    smooth = Peak(g - rate**2 / (2.0 * bend), t - rate / bend)
    fall = rate - rate_high
    ahead = (g_high - g - rate_high * (t_high - t)) / jnp.where(turn.is_smooth | (fall == 0.0), 1.0, fall)
    kink = Peak(g + rate * ahead, t + ahead)
    return Peak(*(jnp.where(turn.is_smooth, a, b) for a, b in zip(smooth, kink, strict=True)))
