"""Maxima of functions of the variables over a run, and their times."""

import dataclasses
import functools as ft

import jax
import jax.numpy as jnp
from jax import Array

from ..._evaluate.groups import Segments
from ..._numbers import Numbers
from ..events.extrema import Peak, highest_turns, located
from ..setup.field import RunArgs, values_of, wanted_pairs
from ..setup.settings import Settings
from ..setup.user_function import UserFunction
from ..step.correction import share
from ..step.interval import EVALUATIONS, PathSample, corrected_sample, sample
from ..step.span import Span


@dataclasses.dataclass(frozen=True, eq=False)
class Peaks:
    """The functions with requested peaks, and their peaks up to the end of a step."""

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
        read, n = ft.partial(self._values_and_rates, args), self.settings.layout.n_states
        return corrected_sample(read, path.plain, error, t, n)._replace(shift=())

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
        last = jnp.ravel(path.fixed_time(end))
        top, ends = located(turn, jax.vmap(lambda t: self._along(t, path, args)), last)
        n = len(best.value)
        inside = Peak(top.value, jnp.asarray(path.moving_time(top.time)))
        before = Peak(ends[-1], jnp.full(n, end))
        after = Peak(self.values(forward * end, y, args), jnp.full(n, end))
        for one, counts in ((inside, turn.exists), (before, True), (after, True)):
            is_lost = jnp.isnan(one.value) & ~jnp.isnan(best.value)  # there is no largest value from here on
            is_higher = counts & ((one.value > best.value) | is_lost)
            best = Peak(*(jnp.where(is_higher, a, b) for a, b in zip(one, best, strict=True)))
        return jnp.concatenate(best)
