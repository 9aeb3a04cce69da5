"""Unknowns that are iterated for, read between and at the jumps of what they depend on."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Connections, Discrete, Equations, Events, Param, Scalar, Var, connect, eq, simulate, when
from components.blocks import Input, Staircase, Step

TIMES = np.array([0.0, 0.25, 0.5, 0.75, 0.95, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0])
LEVELS = np.array([1000.0, 0.0, 500.0])


class Opening(Component):
    """(x - level)^(3/2) = 1 + t / 10 above the level: flat below it, where iterations find no way."""

    x: Var[Scalar, ""] = 1e6
    y: Var[Scalar, ""] = 0.0
    level: Input = Input()

    def equations(self, d: Self) -> Equations:
        beyond = jnp.maximum(self.x - self.level.value, 0.0)
        return dict(law=eq(beyond**1.5, 1.0 + 0.1 * self.y), growth=eq(d.y, 1.0, check_units=False))


class Commanded(Component):
    source: Staircase
    opening: Opening = Opening()

    def connections(self) -> Connections:
        return (connect(self.source.y, self.opening.level),)


class Switched(Component):
    """The same, with a level that events set."""

    levels: Param[Any, ""]
    level: Discrete[Scalar, ""] = 1000.0
    x: Var[Scalar, ""] = 1e6
    y: Var[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        beyond = jnp.maximum(self.x - self.level, 0.0)
        return dict(law=eq(beyond**1.5, 1.0 + 0.1 * self.y), growth=eq(d.y, 1.0, check_units=False))

    def events(self) -> Events:
        return dict(fall=when(self.y > 1.0, level=self.levels[1]), rise=when(self.y > 2.0, level=self.levels[2]))


def expected(t: Any) -> Any:
    return LEVELS[np.minimum(np.searchsorted([1.0, 2.0], t, side="right"), 2)] + (1.0 + 0.1 * t) ** (2 / 3)


@pytest.mark.thorough
@pytest.mark.parametrize(("dense", "t1"), [(False, 2.0), (True, 3.0)])
def test_a_source_that_jumps(dense: bool, t1: float) -> None:
    model = Commanded(source=Staircase(times=[0.0, 1.0, 2.0, 3.0], values=LEVELS))
    ts = TIMES[: np.searchsorted(TIMES, t1, side="right")]
    sol = simulate(model, t1, save="dense" if dense else ts)
    x = np.asarray(sol.at(ts).opening.x if dense else sol["opening.x"])
    between = ~np.isin(ts, [1.0, 2.0, 3.0])  # at a jump the value may be that on either side
    np.testing.assert_allclose(x[between], expected(ts)[between], rtol=1e-6)
    assert np.all(np.isfinite(x))


class Lag(Component):
    """x follows a step, k times as fast as a second passes."""

    k: Param[Scalar, "1/s"]
    x: Var[Scalar, ""] = 0.0
    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        return dict(lag=eq(d.x, self.k * (self.u.value - self.x)))


class Stepped(Component):
    source: Step
    lag: Lag

    def connections(self) -> Connections:
        return (connect(self.source.y, self.lag.u),)


@pytest.mark.thorough
@pytest.mark.parametrize("dense", [False, True])
def test_a_state_at_the_jump_of_its_rate_has_not_moved(dense: bool) -> None:
    """However fast it is: the step before the jump ends there but for rounding."""
    k = 10.0 ** jnp.linspace(0.0, 6.0, 25)

    def followed(k: Any, instant: Any) -> Any:
        model = Stepped(source=Step(height=2.0, offset=1.0, start_time=instant), lag=Lag(k=k))
        sol = simulate(model, 3.0, save="dense" if dense else jnp.stack([instant, jnp.asarray(3.0)]))
        return sol.at(instant).lag.x if dense else sol["lag.x"][0]

    found = jax.jit(jax.vmap(followed))(k, jnp.linspace(0.7, 1.3, 25))
    np.testing.assert_allclose(found, 1.0 - jnp.exp(-k * jnp.linspace(0.7, 1.3, 25)), atol=1e-6)


@pytest.mark.thorough
@pytest.mark.parametrize("dense", [False, True])
def test_an_event_that_sets_a_level(dense: bool) -> None:
    sol = simulate(Switched(levels=LEVELS), 3.0, save="dense" if dense else TIMES)
    x = np.asarray(sol.at(TIMES).x if dense else sol["x"])
    between = ~np.isin(TIMES, [1.0, 2.0])
    np.testing.assert_allclose(x[between], expected(TIMES)[between], rtol=1e-6)
    assert np.all(np.isfinite(x))
