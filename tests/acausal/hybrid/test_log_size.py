"""The length of the event log costs nothing in a step, and it has room for all events of one instant."""

import math
from collections.abc import Iterator
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Discrete, Equations, Events, Param, Scalar, Time, Var, at, eq, ifelse, simulate, when

IN_PLACE = ("dynamic_update_slice", "scatter", "maybe_set", "copy")


class Counted(Component):
    """A state that is set back to zero whenever it reaches 1, beside a clock."""

    rate: Param[Scalar, "1/s"]
    x: Var[Scalar, "1"] = 0.0
    ticks: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, self.rate))

    def events(self) -> Events:
        return dict(full=when(self.x > 1.0, x=0.0), tick=at(0.0, every=0.1, ticks=self.ticks + 1.0))


def operations(jaxpr: Any, in_loop: bool = False) -> Iterator[Any]:
    """Operations in the bodies of loops that are no calls themselves."""
    for equation in jaxpr.eqns:
        items = [item for value in equation.params.values() for item in (value if type(value) is tuple else (value,))]
        inner = [getattr(item, "jaxpr", item) for item in items]
        inner = [item for item in inner if hasattr(item, "eqns")]
        if in_loop and not inner:
            yield equation
        for item in inner:
            yield from operations(item, in_loop or equation.primitive.name in ("while", "scan"))


def numbers_in_a_step(max_events: int) -> int:
    """The count of numbers that a run computes in each pass of its loops, except those written in place."""

    def run(rate: Any) -> Any:
        sol = simulate(Counted(rate=rate), 1.0, save="end", max_events=max_events, throw=False)
        return sol.final.x, sol.events.times

    found = operations(jax.make_jaxpr(run)(3.0).jaxpr)
    outputs = [output.aval for item in found if item.primitive.name not in IN_PLACE for output in item.outvars]
    return sum(math.prod(output.shape) for output in outputs)


@pytest.mark.thorough
def test_a_longer_log_makes_no_step_dearer() -> None:
    few = numbers_in_a_step(33)
    assert few > 100
    assert numbers_in_a_step(4099) == few


class Switching(Component):
    """An `ifelse` that changes twice a second, and events at known times."""

    n: Discrete[Scalar, "1"] = 0.0
    x: Var[Scalar, "1"] = 0.0
    s: Var[Scalar, "1"] = 0.0
    c: Var[Scalar, "1"] = 1.0

    def equations(self, d: Self) -> Equations:
        w = 2.0 * jnp.pi
        return dict(
            ramp=eq(d.x, ifelse(self.s > 0.0, 1.0, -1.0), check_units=False),
            sine=eq(d.s, w * self.c, check_units=False),
            cosine=eq(d.c, -w * self.s, check_units=False),
        )

    def events(self) -> Events:
        return dict(step=at(jnp.array([1.2, 2.2, 3.2]), n=self.n + 1.0))


@pytest.mark.thorough
def test_changes_of_equations_take_no_room_from_events() -> None:
    def times(n: Any) -> Any:
        return simulate(Switching(n=n), 4.0, max_events=3).events.times

    for found in (times(0.0), jax.jit(times)(0.0)):
        np.testing.assert_allclose(found, [1.2, 2.2, 3.2], rtol=1e-12)


class Crowded(Component):
    """Twenty events at one time known in advance, and twenty of conditions on time."""

    start: Param[Scalar, "s"]
    t: Time[Scalar, "s"] = 0.0
    n: Discrete[Scalar, "1"] = 0.0
    x: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, self.n, check_units=False))

    def events(self) -> Events:
        planned: Events = {f"planned_{i}": at(self.start, n=i) for i in range(20)}
        reached: Events = {f"reached_{i}": when(self.t >= self.start, n=20.0 + i) for i in range(20)}
        return planned | reached


@pytest.mark.thorough
def test_all_events_that_time_triggers_at_one_instant_are_recorded() -> None:
    def times(start: Any) -> Any:
        return simulate(Crowded(start=start), 2.0, max_events=64).events.times

    assert len(times(1.0)) == 40
    found, slopes = jax.jit(lambda start: jax.jvp(times, (start,), (1.0,)))(1.0)
    np.testing.assert_allclose(found[:40], 1.0, rtol=1e-12)
    np.testing.assert_allclose(slopes[:40], 1.0, rtol=1e-12)
