"""Clocks whose interval is not positive are refused, whenever that comes out."""

from typing import Self

import equinox as eqx
import jax.numpy as jnp
import pytest

from acausal import (
    Array,
    Component,
    Discrete,
    Equations,
    Events,
    Param,
    Result,
    Scalar,
    SimulationError,
    Var,
    at,
    eq,
    initialise,
    positive,
    repeat,
    simulate,
)

REFUSED = r"clock\.tick\.every: the interval between repetitions must be positive\. Remedy"


class Counter(Component, partial=True):
    """Ticks are counted."""

    ticks: Discrete[Scalar, "1"] = 0.0
    x: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(rest=eq(d.x))


class Clock(Counter):
    interval: Param[Scalar, "s"] = 0.25

    def events(self) -> Events:
        return dict(tick=at(0.0, every=self.interval, ticks=self.ticks + 1.0))


class Declared(Counter):
    interval: Param[Scalar, "s", positive] = 0.25

    def events(self) -> Events:
        return dict(tick=at(0.0, every=self.interval, ticks=self.ticks + 1.0))


class Hastened(Counter):
    """After 0.7 s the interval is shorter."""

    interval: Discrete[Scalar, "s"] = 0.5
    less: Param[Scalar, "s", positive] = 1.0

    def events(self) -> Events:
        return dict(
            tick=at(0.1, every=self.interval, ticks=self.ticks + 1.0),
            hasten=at(0.7, interval=self.interval - self.less),
        )


class Holder(Component):
    clock: Counter


class Clocks(Component):
    clocks: Array[Clock] | Array[Declared]


@pytest.mark.thorough
@pytest.mark.parametrize("interval", [0.0, -0.25])
def test_an_interval_that_is_not_positive_is_refused(interval: float) -> None:
    model = Holder(clock=Clock(interval=interval))
    with pytest.raises(SimulationError, match=r"At t = 0 s: " + REFUSED):
        simulate(model, 1.0)
    assert simulate(model, 1.0, throw=False).result == Result.refused
    with pytest.raises(SimulationError, match=REFUSED):
        initialise(model, steady=True)


@pytest.mark.thorough
def test_it_is_refused_where_numbers_are_traced() -> None:
    @eqx.filter_jit
    def ticks(interval: Scalar) -> Scalar:
        return simulate(Holder(clock=Clock(interval=interval)), 1.1).final.clock.ticks

    assert ticks(jnp.asarray(0.25)) == 5.0
    with pytest.raises(RuntimeError, match="cannot do what is asked"):
        ticks(jnp.asarray(-0.25))


@pytest.mark.thorough
def test_an_interval_that_an_event_makes_negative_is_refused() -> None:
    with pytest.raises(SimulationError, match=r"At t = 0\.7 s: " + REFUSED):
        simulate(Holder(clock=Hastened()), 9.0)
    assert simulate(Holder(clock=Hastened(less=0.1)), 1.2).final.clock.ticks == 3.0


@pytest.mark.thorough
def test_a_declared_interval_costs_no_relation() -> None:
    assert simulate(Holder(clock=Declared()), 1.1).events.labels == ("clock.tick",)
    clocks = simulate(Clocks(clocks=repeat(Declared(), 2)), 1.1)
    assert clocks.events.labels == ("clocks[0].tick", "clocks[1].tick")


@pytest.mark.thorough
def test_a_member_of_an_array_is_named() -> None:
    clocks = Clocks(clocks=repeat(Clock(interval=jnp.array([0.5, -0.5])), 2))
    with pytest.raises(SimulationError, match=r"clocks\[1\]\.tick\.every"):
        simulate(clocks, 1.1)
