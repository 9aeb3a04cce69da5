"""Events that come and go many times within a step, by what turns while nothing makes steps short."""

import math
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Float
from scipy.optimize import root_scalar

from acausal import Array as Of
from acausal import Component, Discrete, Equations, Events, Param, Scalar, Time, Var, eq, simulate, when
from acausal._reduce.angles import with_angles

Samples = Float[jax.Array, "21"]
N, SAMPLES = 48, 21
FULL = 2.0 * math.pi


class Shaft(Component):
    """A shaft that turns steadily beside a clock; both are solutions of the first order, and steps are long."""

    w: Param[Scalar, "rad/s"]
    level: Param[Scalar, "1"]
    t: Time[Scalar, "s"] = 0.0
    phi: Var[Scalar, "rad"] = 0.0
    by_clock: Discrete[Scalar, "1"] = 0.0
    by_angle: Discrete[Scalar, "1"] = 0.0
    by_turn: Discrete[Scalar, "1"] = 0.0
    by_half: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(speed=eq(d.phi, self.w))

    def events(self) -> Events:
        share = jnp.mod(self.phi / FULL, 1.0)
        return dict(
            clock=when(jnp.cos(self.w * self.t) < -self.level, by_clock=self.by_clock + 1.0),
            angle=when(jax.jit(jnp.sin)(self.phi) > self.level, by_angle=self.by_angle + 1.0),
            half=when(jnp.maximum(jnp.sin(self.phi), 0.0) > self.level, by_half=self.by_half + 1.0),
            turn=when(share > self.level, by_turn=self.by_turn + 1.0),
        )


@pytest.mark.thorough
def test_each_turn_is_counted() -> None:
    """However short each time for which a condition holds, and however many turns a step would take."""
    rng = np.random.default_rng(0)
    turns, w = rng.integers(1, 60, N), 10.0 ** rng.uniform(-2.0, 3.0, N)
    level = 1.0 - 10.0 ** rng.uniform(-5.0, -0.01, N)

    @jax.jit
    @jax.vmap
    def counts(w: Any, level: Any, end: Any) -> Any:
        final = simulate(Shaft(w=w, level=level), end, dt0=end, save="end").final
        return final.by_clock, final.by_angle, final.by_half, final.by_turn

    for count in counts(w, level, (turns - 1e-7) * FULL / w):
        np.testing.assert_array_equal(count, turns)


class Track(Component):
    """A table that is followed at a steady speed."""

    places: Param[Samples, "m"]
    heights: Param[Samples, "m"]
    s: Var[Scalar, "m"] = 0.0
    bumps: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(speed=eq(d.s, 1.0, check_units=False))

    def events(self) -> Events:
        return dict(bump=when(jnp.interp(self.s, self.places, self.heights) > 0.5, bumps=self.bumps + 1.0))


class Tracks(Component):
    """Two of them."""

    tracks: Of[Track]


@pytest.mark.thorough
def test_each_peak_of_a_table_is_counted() -> None:
    """However narrow it is."""
    rng = np.random.default_rng(1)
    places = np.cumsum(10.0 ** rng.uniform(-3.0, 0.0, (N, 2, SAMPLES)), axis=-1)
    heights = rng.uniform(0.0, 1.0, (N, 2, SAMPLES))
    heights[..., ::2] = 0.0

    @jax.jit
    @jax.vmap
    def bumps(places: Any, heights: Any) -> Any:
        model = Tracks(tracks=Of(item=Track(places=places, heights=heights), n=2))
        return simulate(model, jnp.max(places), dt0=10.0, save="end").final.tracks[:].bumps

    found = bumps(jnp.asarray(places), jnp.asarray(heights))
    np.testing.assert_array_equal(found, np.sum(heights > 0.5, axis=-1))


class Swell(Component):
    """A wave whose height grows slowly."""

    w: Param[Scalar, "rad/s"]
    t: Time[Scalar, "s"] = 0.0
    x: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, 1.0, check_units=False))

    def events(self) -> Events:
        return dict(spill=when(self.x * jnp.sin(self.w * self.t) > 1.0))


@pytest.mark.thorough
def test_a_search_that_takes_many_points_is_gone_on_with() -> None:
    """The first wave that is high enough comes after thousands of turns, all within the first step."""
    w = 1e4
    solution = simulate(Swell(w=w), 1.5, dt0=1.5, save="end")
    crest = (math.ceil(w / FULL - 0.25) + 0.25) * FULL / w
    rise = (crest - 0.25 * FULL / w, crest)
    first = root_scalar(lambda t: t * math.sin(w * t) - 1.0, bracket=rise).root
    np.testing.assert_allclose(solution.events.times[0], first, rtol=1e-9)
    assert solution.stats["num_steps"] < 1000


@pytest.mark.thorough
def test_angles_within_functions() -> None:
    """Angles in branches, in functions that are compiled separately, and in functions with their own derivatives."""

    @jax.custom_jvp
    def own(x: Any) -> Any:
        return jnp.cos(3.0 * x)

    own.defjvp(lambda x, dx: (own(*x), -3.0 * jnp.sin(3.0 * x[0]) * dx[0]))

    def function(x: Any) -> Any:
        branch = jax.lax.cond(x > 0.0, lambda x: jnp.sin(5.0 * x), lambda x: x, x)
        return jnp.stack([jax.jit(lambda x: jnp.tan(2.0 * x))(x), own(x), branch, jnp.round(x), jnp.exp(x)])

    found = jax.jit(with_angles(function))(0.7)
    np.testing.assert_allclose(np.sort(found.angles), np.sort([1.4, 2.1, 3.5, FULL * 1.2]))
    np.testing.assert_allclose(found.value, function(0.7))
    assert found.steps == 1.0
    rate = jax.jvp(with_angles(function), (0.7,), (1.0,))[1]
    np.testing.assert_allclose(rate.value, jax.jacfwd(function)(0.7))


@pytest.mark.thorough
def test_places_in_tables_of_arrays() -> None:
    """One table for many, many tables for one, one for each, of single numbers and of vectors."""
    tables, points = jnp.array([[0.0, 1.0, 3.0], [0.0, 2.0, 6.0]]), jnp.array([2.0, 4.0])

    def places(axes: tuple[Any, Any], table: Any, x: Any) -> Any:
        look = jax.vmap(lambda table, x: jnp.interp(x, table, table), axes)
        return with_angles(lambda x: look(table, x))(x).angles / FULL

    np.testing.assert_allclose(places((None, 0), tables[0], points), [1.5, 2.0])
    np.testing.assert_allclose(places((0, None), tables, points[0]), [1.5, 1.0])
    np.testing.assert_allclose(places((0, None), tables, points), [1.5, 2.0, 1.0, 1.5])
    np.testing.assert_allclose(places((0, 0), tables, points), [1.5, 1.5])
