"""Events close together, in either order, and modes in which a system has no solution."""

import re
from typing import Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import (
    Array,
    Component,
    Connections,
    Discrete,
    Equations,
    Events,
    Param,
    Result,
    Scalar,
    SimulationError,
    Time,
    Var,
    at,
    connect,
    eq,
    refuse,
    repeat,
    simulate,
    when,
)
from components.blocks import Step
from components.electrical import ConstantVoltage, Ground, IdealOpeningSwitch, Inductor, Resistor


class Gates(Component):
    """x rises at the rate 1; at `a` it is doubled and at `b` it grows by 1, whichever comes first."""

    a: Param[Scalar, "s"]
    b: Param[Scalar, "s"]
    t: Time[Scalar, "s"] = 0.0
    x: Var[Scalar, "s"] = 0.0
    passed: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(rise=eq(d.x, 1.0))

    def events(self) -> Events:
        return dict(
            double=when(self.t > self.a, x=2.0 * self.x, passed=10.0 * self.passed + 1.0),
            add=when(self.t > self.b, x=self.x + 1.0, passed=10.0 * self.passed + 2.0),
        )


def final(a: float, b: float) -> tuple[Scalar, Scalar]:
    end = simulate(Gates(a=a, b=b), 2.0, save="end", dt0=2.0).final
    return end.x, end.passed


@pytest.mark.thorough
@pytest.mark.parametrize("apart", [0.3, 1e-3, 1e-9])
def test_two_events_in_one_step_in_either_order(apart: float) -> None:
    """The rate is constant, so that a step is as long as the run but for the events."""
    run = jax.jit(final)
    early, late = 0.7, 0.7 + apart
    np.testing.assert_allclose(np.asarray(run(early, late)), (2.0 + early + 1.0, 12.0), rtol=1e-12)
    np.testing.assert_allclose(np.asarray(run(late, early)), (2.0 + late + 2.0, 21.0), rtol=1e-12)


@pytest.mark.thorough
def test_two_events_at_one_instant() -> None:
    """Both start from the values before them; where they change the same variable, the one stated last counts."""
    np.testing.assert_allclose(np.asarray(final(0.7, 0.7)), (2.0 + 1.0, 2.0), rtol=1e-12)


class Climb(Component):
    """x rises, half as fast from where it passes 1."""

    x: Var[Scalar, "1"] = 0.0
    rate: Param[Scalar, "1/s"] = 0.01
    passed: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(rise=eq(d.x, self.rate * jnp.where(self.passed > 0.5, 0.5, 1.0)))

    def events(self) -> Events:
        return dict(passes=when((self.passed < 0.5) & (self.x > 1.0), passed=1.0))


@pytest.mark.thorough
@pytest.mark.parametrize("save", [[0.1, 0.2, 0.6, 1.1], [0.1, 0.1 + 1e-11, 1.1]])
def test_an_event_so_near_that_rounding_keeps_the_state_before_it(save: list[float]) -> None:
    def run(rate: Scalar, below: Scalar) -> tuple[Scalar, Scalar]:
        model = Climb(x=1.0 - below, rate=rate)
        sol = simulate(model, 1.1, t0=0.1, save=np.array(save), dt0=1.0, max_steps=200, throw=False)
        return sol.stats["num_steps"], sol.final.x

    rates, below = jnp.meshgrid(jnp.geomspace(1e-4, 1.0, 50), jnp.array([0.0, 1e-16]))
    steps, x = jax.vmap(run)(rates.ravel(), below.ravel())
    assert int(jnp.max(jnp.asarray(steps))) <= 6
    np.testing.assert_allclose(x, 1.0 + 0.5 * rates.ravel(), rtol=0.0, atol=1e-12)


class Undone(Component):
    """x falls and shuts at 1, which at once opens again and is lifted by as much as rounding might, once."""

    x: Var[Scalar, "1"] = 0.0
    lift: Param[Scalar, "1"]
    is_open: Discrete[Scalar, "1"] = 1.0
    lifts: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(fall=eq(d.x, jnp.where(self.is_open > 0.5, -1.0, -0.5), check_units=False))

    def events(self) -> Events:
        opens = (self.is_open < 0.5) & (self.lifts < 0.5)
        return dict(
            shut=when((self.is_open > 0.5) & (self.x < 1.0), is_open=0.0),
            reopen=when(opens, is_open=1.0, lifts=1.0, x=1.0 + self.lift),
        )


@pytest.mark.parametrize("lift", [1e-15, 1e-13, 1e-6])
def test_what_is_undone_at_the_instant_at_which_it_happens_can_happen_again(lift: float) -> None:
    sol = simulate(Undone(x=1.5, lift=lift), 1.5)
    assert [name.rpartition(".")[2] for name in sol.events.names] == ["shut", "reopen", "shut"]
    assert float(sol.final.x) == pytest.approx(0.5, abs=2e-6)


@pytest.mark.thorough
def test_derivatives_by_the_times_of_two_events_in_one_step() -> None:
    """After the doubling at a, x = t + a, and b does not matter; the other way round, x = t + 2 + a."""
    slopes = jax.jit(jax.jacrev(lambda a, b: final(a, b)[0], argnums=(0, 1)))
    for a, b in ((0.7, 0.701), (0.701, 0.7)):
        np.testing.assert_allclose(jnp.stack(slopes(a, b)), [1.0, 0.0], atol=1e-12)


class Interrupted(Component):
    """A switch without leakage opens a circuit whose coil keeps its current: no voltage is enough."""

    source: ConstantVoltage
    resistor: Resistor
    coil: Inductor
    switch: IdealOpeningSwitch
    command: Step
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.source.p, self.resistor.p),
            connect(self.resistor.n, self.coil.p),
            connect(self.coil.n, self.switch.p),
            connect(self.switch.n, self.source.n, self.ground.p),
            connect(self.command.y, self.switch.u),
        )


@pytest.mark.thorough
def test_a_mode_without_a_solution_is_named() -> None:
    model = Interrupted(
        source=ConstantVoltage(V=1.0),
        resistor=Resistor(R=1.0),
        coil=Inductor(L=1.0),
        switch=IdealOpeningSwitch(Ron=0.0, Goff=0.0),
        command=Step(height=1.0, start_time=0.5),
    )
    said = r"At t = 0\.5 s: After the events? .*switch\.rise.*switch\.s is infinite.*switch\.current_path.*Remedy"
    with pytest.raises(SimulationError, match=said):
        simulate(model, 1.0)
    assert simulate(model, 1.0, throw=False).result == Result.not_finite


class Counter(Component):
    """Counts the ticks of a clock, up to a limit."""

    every: Param[Scalar, "s"]
    limit: Param[Scalar, "1"]
    ticks: Discrete[Scalar, "1"] = 0.0
    x: Var[Scalar, "s"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(rise=eq(d.x, 1.0))

    def events(self) -> Events:
        return dict(
            tick=at(self.every, every=self.every, ticks=self.ticks + 1.0),
            _limit=refuse(self.ticks > self.limit, "Its display is full."),
        )


class Counters(Component):
    items: Array[Counter]


def counters(limits: tuple[float, float]) -> Counters:
    return Counters(items=repeat(Counter(every=0.01, limit=jnp.array(limits)), 2))


@pytest.mark.thorough
def test_what_happened_last_is_named_however_long_the_run() -> None:
    """The message names the members of an array that refused, although the record of events was full long before."""
    full = "At t = 0.61 s: items[1]._limit: Its display is full."
    with pytest.raises(SimulationError, match=f"^{re.escape(full)}$"):
        simulate(counters((1e9, 60.5)), 1.0, max_events=3)
    both = "At t = 0.21 s: items[0]._limit: Its display is full. items[1]._limit: Its display is full."
    with pytest.raises(SimulationError, match=f"^{re.escape(both)}$"):
        simulate(counters((20.5, 20.5)), 1.0, max_events=3)
    ticks = r"The last events were items\[0\]\.tick, items\[1\]\.tick, 8 within 0\.0[34]"
    with pytest.raises(SimulationError, match=rf"steps was reached.*{ticks}"):
        simulate(counters((1e9, 1e9)), 1.0, max_events=3, max_steps=50)
