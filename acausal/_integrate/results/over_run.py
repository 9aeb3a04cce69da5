"""Integrals and peaks of functions of the variables over a run, computed from its recorded steps."""

import dataclasses
import functools as ft
from collections.abc import Callable
from typing import Any, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._evaluate.starts import Inputs
from ..._numbers import Numbers
from ..._tracing import are_traced
from ..loop.carry import StepRecord
from ..loop.peaks import Peak
from ..setup.user_function import UserFunction
from .reading import SHARES, Reading
from .trajectories import NUMBERS, trajectories

ROWS = NUMBERS[-1]  # number of rows in one evaluation of a function, if numbers are known
POINTS = 8 * SHARES  # samples in each round of the search for a peak
ROUNDS = 8  # rounds that locate a peak to 1e-10 of a step
NEAR = 1e-3  # fraction of a step for the difference quotient of a rate
SAMPLES, PLACES = np.linspace(0.0, 1.0, SHARES), np.linspace(0.0, 1.0, 201)  # fractions of a step
CURVE = np.vander(PLACES, SHARES) @ np.linalg.inv(np.vander(SAMPLES, SHARES))  # the polynomial through the samples
T = TypeVar("T")


@dataclasses.dataclass(frozen=True)
class OverRun:
    """A function of the variables over a run, with its `constants` and the `params` that it reads, by leaf."""

    reading: Reading
    function: UserFunction
    constants: list[Numbers]
    params: dict[int, Numbers]
    record: StepRecord
    inputs: Inputs
    forward: Any  # 1, or -1 for a run backwards in time

    def integral(self) -> Any:
        """Integrals over time, by Gaussian quadrature in each step."""
        places, weights = np.polynomial.legendre.leggauss(SHARES)
        steps, is_there = self._steps()
        values = self._within(steps, np.broadcast_to(0.5 * (1.0 + places), (len(steps), SHARES)))[1]
        widths = jnp.where(is_there, self.record.ts[steps + 1] - self.record.infos["start"][steps], 0.0)
        means = jnp.tensordot(0.5 * weights, jnp.where(is_there[:, None, None], values, 0.0), (0, 1))
        return self.forward * widths @ means

    def peak(self) -> Peak:
        """The maxima and their times.

        Each step is evaluated at samples and at the maximum of the polynomial through them, because peaks of nearly
        equal height differ by less than they exceed the samples. The search then narrows the interval around the
        largest value. In traced runs, a Newton step t* = t - r / r' with the rate r gives the derivatives of the time
        of an extremum. By the envelope theorem, the derivatives of its value are those at fixed time.
        """
        held = self._held()
        steps, is_there = held._steps()
        samples = held._within(steps, np.broadcast_to(SAMPLES, (len(steps), SHARES)))[1]

        def top(j: Any) -> Peak:
            highest = jnp.asarray(PLACES)[jnp.argmax(samples[:, :, j] @ CURVE.T, axis=1)][:, None]
            shares = jnp.concatenate([jnp.broadcast_to(SAMPLES, (len(steps), SHARES)), highest], axis=1)
            values = jnp.concatenate([samples[:, :, j], held._within(steps, highest)[1][:, :, j]], axis=1)
            best = jnp.argmax(jnp.where(is_there[:, None], values, -jnp.inf))
            step, share = best // (SHARES + 1), jnp.ravel(shares)[best]
            place = _repeated(ft.partial(held._narrowed, step, j), (share, 1.0 / (SHARES - 1)), held._is_traced)[0]
            return self._refined(step, place, j)

        n = self.function.n_outputs
        tops = jax.vmap(top)(jnp.arange(n)) if held._is_traced else _stacked([top(j) for j in range(n)])
        t, y = self.record.ts[self.record.n], self.record.ys[self.record.n]
        last = self.values(jnp.reshape(t, 1), y[None])[0]
        is_last = ~((self.record.n > 0) & (tops.value >= last))  # the value after an event at the end
        return Peak(jnp.where(is_last, last, tops.value), jnp.where(is_last, self.forward * t, tops.time))

    def lost(self) -> Array:
        """The decrease of the first function across the listed events at the end of each step."""
        record = self.record
        is_cut = jnp.isfinite(record.moments) & (record.moments > record.ts[0])
        rows = is_cut[:, None]
        before = jnp.where(rows, record.befores, record.ys[:1]), jnp.where(is_cut, record.moments, record.ts[0])
        after = jnp.where(rows, record.ys[1:], record.ys[:1]), jnp.where(is_cut, record.ts[1:], record.ts[0])
        high, low = (self.values(t, y)[:, 0] for y, t in (before, after))
        return jnp.where(is_cut, high - low, 0.0)

    def _narrowed(self, step: Array, j: Any, bracket: tuple[Any, Any]) -> tuple[Any, Any]:
        """The best of several places in a bracket, and the half width of the next bracket around it."""
        place, width = bracket
        theta = jnp.clip(place + width * jnp.linspace(-1.0, 1.0, POINTS), 0.0, 1.0)
        rows = theta.reshape(-1, SHARES)
        found = self._within(jnp.broadcast_to(step, len(rows)), rows)[1].reshape(POINTS, -1)[:, j]
        return theta[jnp.argmax(found)], width * 2.0 / (POINTS - 1)

    def _refined(self, step: Array, place: Array, j: Any) -> Peak:
        """The peak near a place in a step. At the ends of the step, and at a kink, the value at that place."""

        def function(theta: Array) -> tuple[Array, Array]:
            t, values = self._within(step[None], theta[None, None])
            return values[0, 0, j], t[0, 0]

        if not self._is_traced:
            value, time = function(place)
            return Peak(value, self.forward * time)
        near = jnp.clip(place + jnp.asarray([-NEAR, 0.0, NEAR]), 0.0, 1.0)
        (values, _), (rates, speeds) = jax.vmap(lambda x: jax.jvp(function, (x,), (jnp.ones_like(x),)))(near)
        slope = jax.lax.stop_gradient((rates[2] - rates[0]) / (near[2] - near[0]))
        back = rates[1] / jnp.where(slope < 0.0, slope, -jnp.inf)
        is_smooth = (place > 0.0) & (place < 1.0) & (jnp.abs(jax.lax.stop_gradient(back)) < NEAR)
        back = jnp.where(is_smooth, back, 0.0)
        time = function(place)[1] - back * speeds[1]
        return Peak(values[1] - 0.5 * rates[1] * back, self.forward * time)

    def _within(self, steps: Any, theta: Any) -> tuple[Any, Any]:
        """Times and values of the function at fractions [steps, shares] of some steps."""
        if self._is_traced or are_traced(steps, theta):
            return self._of_block(steps, theta)
        steps, theta = np.asarray(steps), np.asarray(theta)
        blocks = [slice(i, i + ROWS // SHARES) for i in range(0, len(steps), ROWS // SHARES)]
        ts, values = zip(*(self._of_block(steps[block], theta[block]) for block in blocks), strict=True)
        return np.concatenate(ts), np.concatenate(values)

    def _of_block(self, steps: Any, theta: Any) -> tuple[Any, Any]:
        ts, ys = self.reading.within(steps, theta, self.record, self.inputs, self.forward)
        values = self.values(ts.reshape(-1), ys.reshape(-1, ys.shape[-1]))
        return ts, values.reshape(*ts.shape, -1)

    def values(self, ts: Any, ys: Any) -> Any:
        """Values of the function at forward times and state vectors."""
        if self._is_traced or are_traced(ts, ys):
            return self._values(ts, ys)
        ts, ys = np.asarray(ts), np.asarray(ys)
        blocks = [np.arange(i, i + ROWS) for i in range(0, len(ts), ROWS)]
        rows = [np.minimum(block, len(ts) - 1) for block in blocks]
        return np.concatenate([np.asarray(self._values(ts[some], ys[some])) for some in rows])[: len(ts)]

    def _values(self, ts: Any, ys: Any) -> Array:
        system, layout = self.reading.system, self.reading.layout
        found = trajectories(system, 0, self.forward * ts, ys[:, layout.point], self.inputs)
        varying = {leaf: found[leaf] for leaf in self.function.leaves if leaf in found}
        return _evaluated(self.function, len(ts), self.constants, varying, self.params)

    def _steps(self) -> tuple[Any, Any]:
        """Indices of the steps and a mask of those that exist. The last step replaces missing ones."""
        if self._is_traced:
            steps = jnp.arange(len(self.record.moments))
            return jnp.minimum(steps, jnp.maximum(self.record.n - 1, 0)), steps < self.record.n
        steps = np.arange(max(int(self.record.n), 1))
        return steps, steps < int(self.record.n)

    def _held(self) -> "OverRun":
        numbers = (self.constants, self.params, self.record, self.inputs, self.forward)
        return OverRun(self.reading, self.function, *jax.lax.stop_gradient(numbers)) if self._is_traced else self

    @property
    def _is_traced(self) -> bool:
        return are_traced(self.constants, self.params, self.record, self.inputs, self.forward)


@ft.partial(jax.jit, static_argnums=(0, 1))
def _evaluated(
    function: UserFunction, n: int, constants: list[Numbers], varying: dict[int, Any], fixed: dict[int, Any]
) -> Array:
    def at(varying: dict[int, Any], _: Array) -> Array:
        values = fixed | varying
        return jnp.stack(function(constants, [values[leaf] for leaf in function.leaves]))

    return jax.vmap(at)(varying, jnp.zeros(n))


def _repeated(body: Callable[[T], T], start: T, is_traced: bool) -> T:
    """Applies `body` for all rounds, traced as a loop."""
    if is_traced:
        return jax.lax.fori_loop(0, ROUNDS, lambda _, x: body(x), jax.tree.map(jnp.asarray, start))
    for _ in range(ROUNDS):
        start = body(start)
    return start


def _stacked(peaks: list[Peak]) -> Peak:
    return Peak(*(jnp.stack(parts) for parts in zip(*peaks, strict=True)))
