"""Integrals and peaks of functions of the variables over a run, from its recorded steps."""

import dataclasses
import functools as ft
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import PyTree

from .._evaluate.starts import Inputs
from .._numbers import Numbers
from .._tracing import is_traced
from .dense import Record
from .field import values_of, wanted_pairs
from .made_from import digest_of
from .peaks import Peak
from .reading import AT_ONCE, Paths
from .span import Span
from .state_vector import Vector
from .stored_program import result_of
from .user_function import UserFunction

POINTS = 4  # of Gauss' quadrature in a step, which is exact for polynomials of degree 7
SAMPLES = 9  # in a step, among which the highest is looked for
NARROWED = 40  # times by the golden section, to a share of 1e-9 of a step
GOLDEN = (5.0**0.5 - 1.0) / 2.0
NEAR = 1e-3  # share of a step over which the slope of a rate is taken
Given = tuple[list[Numbers], Record, Inputs, Numbers]


@dataclasses.dataclass(frozen=True)
class OverRun(Paths):
    """What is computed of the values of a function over a run."""

    function: UserFunction

    def of(self, constants: list[Numbers], record: Record, inputs: Inputs, forward: Numbers) -> Any:
        """The result for the numbers of a run and those in the function."""
        given = (constants, record, inputs, forward)
        return self(given) if any(map(is_traced, jax.tree.leaves(given))) else result_of(self, given)

    def __call__(self, given: Given) -> PyTree:
        return _called(self, given)

    def computed(self, given: Given) -> PyTree:
        raise NotImplementedError

    def values(self, t: Numbers, y: Vector, constants: list[Numbers], inputs: Inputs) -> Array:
        """The function at a point."""
        system, function, point = self.system, self.function, y[self.layout.point]
        store = system.evaluate(t, point, inputs, wanted_pairs(system, function.leaves), anew=True)
        values = values_of(system, t, point, inputs, store, function.leaves)
        return jnp.stack(function(constants, [values[leaf] for leaf in function.leaves]))

    @property
    def name(self) -> str:
        return type(self).__name__.lower()

    def contents(self, given: Given) -> list[object]:
        function = (self.function.closed, self.function.leaves)
        return [given[2].given, digest_of(self.system), self.solver, self.layout, function]

    def held(self) -> dict[str, Any]:
        return {}


class Integral(OverRun):
    """Integrals over the time of a run, by Gauss' quadrature in each step."""

    def computed(self, given: Given) -> Array:
        constants, record, inputs, forward = given
        spans, ends, is_there = record.spans(self.solver, self.layout)
        places, weights = (np.asarray(x) for x in np.polynomial.legendre.leggauss(POINTS))

        def of_step(step: tuple[Span, Array]) -> Array:
            span, end = step
            vector, width = self.on(span, inputs, forward), end - span.t0

            def rates(place: Array) -> Array:
                t = span.t0 + 0.5 * (1.0 + place) * width
                return self.values(forward * t, vector(t), constants, inputs)

            return 0.5 * width * jnp.tensordot(weights, jax.vmap(rates)(jnp.asarray(places)), 1)

        parts = jax.lax.map(of_step, (spans, ends), batch_size=AT_ONCE)
        return forward * jnp.sum(jnp.where(is_there[:, None], parts, 0.0), axis=0)


class Highest(OverRun):
    """The largest values over a run, and their times.

    The highest of some samples in each step leads to the step and the place; the golden section narrows that down, and
    a step of Newton's method, t* = t - r / r' with the rate r, gives the time of an extremum its derivatives. Those of
    its value are those at that time, by the envelope theorem.
    """

    def computed(self, given: Given) -> tuple[Array, Array]:
        constants, record, inputs, forward = given
        spans, ends, is_there = record.spans(self.solver, self.layout)
        hold, thetas = jax.lax.stop_gradient, jnp.linspace(0.0, 1.0, SAMPLES)

        def at(step: tuple[Span, Array], theta: Array, of: Any = (constants, inputs)) -> Array:
            span, end = step
            t = span.t0 + theta * (end - span.t0)
            return self.values(forward * t, self.on(span, of[1], forward)(t), *of)

        held = hold((constants, inputs))
        samples = jax.lax.map(
            lambda step: jax.vmap(lambda theta: at(step, theta, held))(thetas), hold((spans, ends)), batch_size=AT_ONCE
        )
        flat = jnp.where(is_there[:, None, None], samples, -jnp.inf).reshape(-1, samples.shape[-1])

        def top(j: Array) -> Peak:
            i, k = jnp.divmod(jnp.argmax(flat[:, j]), SAMPLES)
            step = jax.tree.map(lambda x: x[i], (spans, ends))
            low, high = thetas[jnp.maximum(k - 1, 0)], thetas[jnp.minimum(k + 1, SAMPLES - 1)]
            place = _narrowed(lambda theta: at(hold(step), theta, held)[j], low, high, thetas[k])
            return _refined(lambda theta: at(step, theta)[j], place, *self._ends(step))

        tops = jax.vmap(top)(jnp.arange(samples.shape[-1]))
        last = self.values(forward * record.ts[record.n], record.ys[record.n], constants, inputs)
        is_last = ~((record.n > 0) & (tops.value >= last))
        value, time = jnp.where(is_last, last, tops.value), jnp.where(is_last, record.ts[record.n], tops.time)
        return value, forward * time

    def _ends(self, step: tuple[Span, Array]) -> tuple[Array, Array]:
        return jnp.asarray(step[0].t0), step[1]


def _narrowed(function: Any, low: Array, high: Array, best: Array) -> Array:
    """The place of the highest value between two places, by the golden section; or the `best` of samples."""

    def section(ends: tuple[Array, Array], _: None) -> tuple[tuple[Array, Array], None]:
        a, b = ends
        x, y = b - GOLDEN * (b - a), a + GOLDEN * (b - a)
        is_left = function(x) >= function(y)
        return (jnp.where(is_left, a, x), jnp.where(is_left, y, b)), None

    (a, b), _ = jax.lax.scan(section, (low, high), None, length=NARROWED)
    places = jnp.stack([0.5 * (a + b), best])
    return places[jnp.argmax(jax.vmap(function)(places))]


def _refined(function: Any, place: Array, t0: Array, t1: Array) -> Peak:
    """The peak near a place in a step; at its ends, and at a kink, the one at that place."""
    near = jnp.clip(place + jnp.asarray([-NEAR, 0.0, NEAR]), 0.0, 1.0)
    values, rates = jax.vmap(lambda theta: jax.jvp(function, (theta,), (jnp.ones(()),)))(near)
    slope = jax.lax.stop_gradient((rates[2] - rates[0]) / (near[2] - near[0]))
    step = rates[1] / jnp.where(slope < 0.0, slope, -jnp.inf)
    is_smooth = (place > 0.0) & (place < 1.0) & (jnp.abs(jax.lax.stop_gradient(step)) < NEAR)
    step = jnp.where(is_smooth, step, 0.0)
    return Peak(values[1] - 0.5 * rates[1] * step, t0 + jnp.clip(place - step, 0.0, 1.0) * (t1 - t0))


@ft.partial(jax.jit, static_argnums=0)
def _called(over: OverRun, given: Given) -> PyTree:
    return over.computed(given)
