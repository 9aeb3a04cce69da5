"""Models without a steady state are told why."""

from typing import Self

import pytest

from acausal import (
    Component,
    Connections,
    Discrete,
    Equations,
    Events,
    ModelError,
    Param,
    Scalar,
    SimulationError,
    Time,
    Var,
    at,
    connect,
    eq,
    initialise,
)
from components.blocks import Constant, Input, Integrator, Output


class Tank(Component):
    """A level that nothing drains, beside a lag that has a steady state."""

    inflow: Param[Scalar, "m/s"] = 1.0
    level: Var[Scalar, "m"] = 0.5
    lag: Var[Scalar, "m/s"] = 0.0
    T: Param[Scalar, "s"] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(balance=eq(d.level, self.inflow), follow=eq(self.T * d.lag, self.inflow - self.lag))


class Contrary(Component):
    """Two states, of which one rests if x is 0 and the other if x is 1."""

    x: Var[Scalar, "1"] = 0.3
    T: Param[Scalar, "s"] = 1.0
    low: Var[Scalar, "1"] = 0.0
    high: Var[Scalar, "1"] = 0.0
    other: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(
            rest=eq(d.x, 0.0),
            low=eq(self.T * d.low, self.x),
            high=eq(self.T * d.high, 1.0 - self.x),
            other=eq(d.other, 0.0),
        )


@pytest.mark.thorough
def test_a_state_without_a_balance_is_named() -> None:
    with pytest.raises(
        SimulationError, match=r"No steady state: level integrates .* no start value balances it\."
    ) as error:
        initialise(Tank(), steady=True)
    assert "`moving=['level']`" in str(error.value)
    assert "linearly dependent" not in str(error.value)
    assert float(initialise(Tank(), steady=True, moving=["level"]).lag) == pytest.approx(1.0)


@pytest.mark.thorough
def test_states_that_exclude_each_other_at_rest_are_named() -> None:
    with pytest.raises(SimulationError, match=r"bring the rates of (low, high|high, low) to zero together\.") as error:
        initialise(Contrary(), steady=True)
    assert str(error.value).count("No steady state") == 1


class Sampler(Component):
    """y is u at the last sample."""

    held: Discrete[Scalar, ""] = 0.0
    t: Time[Scalar, "s"] = 0.0
    u: Input = Input()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(hold=eq(self.y.value, self.held))

    def events(self) -> Events:
        return dict(sample=at(0.0, every=0.1, held=1.0 - self.u.value))


class Loop(Component):
    """The integrator follows the sampler, which reads it or a constant."""

    sampler: Sampler
    integrator: Integrator
    logger: Sampler
    source: Constant
    is_closed: bool = True

    def connections(self) -> Connections:
        read = self.integrator.y if self.is_closed else self.source.y
        return (
            connect(self.sampler.y, self.integrator.u),
            connect(read, self.sampler.u),
            connect(self.integrator.y, self.logger.u),
        )


def loop(*, is_closed: bool) -> Loop:
    integrator, source = Integrator(k=1.0), Constant(k=1.0)
    return Loop(sampler=Sampler(), integrator=integrator, logger=Sampler(), source=source, is_closed=is_closed)


def test_a_loop_through_samples_has_no_steady_state_of_the_states() -> None:
    with pytest.raises(ModelError, match=r"each tick of sampler\.sample and not in between.* Remedy"):
        initialise(loop(is_closed=True), steady=True)


@pytest.mark.thorough
def test_samples_outside_of_loops_are_no_hindrance() -> None:
    """The sampler reads a constant, and the logger acts on nothing."""
    initialise(loop(is_closed=False), steady=True)
