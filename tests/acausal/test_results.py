"""Every outcome of a run, without and with an error, and what is said of it."""

from collections.abc import Callable
from typing import Any, NamedTuple, Self

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from _models import gear_train, rc
from _switching_models import Rebound, Relay, Undoing, forced_gear

from acausal import (
    ROW,
    Component,
    Connections,
    Discrete,
    Equations,
    Events,
    Param,
    ParameterError,
    Result,
    Scalar,
    SimulationError,
    Solution,
    Var,
    Vector,
    connect,
    eq,
    ifelse,
    refuse,
    remember,
    shape,
    simulate,
)
from components.rotational import IdealGear, Inertia
from components.translational import Mass


class BlowUp(Component):
    """x = tan(t): infinite at pi/2."""

    x: Var[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(growth=eq(d.x, 1.0 + self.x**2))


class Root(Component):
    """x = 1 - t, of which no state depends on the root."""

    x: Var[Scalar, ""] = 1.0
    root: Var[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(fall=eq(d.x, -1.0), root=eq(self.root, jnp.sqrt(self.x)))


class Forgetful(Component):
    """x = exp(t), of which only the last two steps are remembered."""

    x: Var[Scalar, ""] = 1.0
    past: Discrete[Vector, "", shape(3, ROW)] = -jnp.inf

    def equations(self, d: Self) -> Equations:
        return dict(growth=eq(d.x, self.x))

    def events(self) -> Events:
        return dict(kept=remember(0.9, past=self.x))


class Rootless(Component):
    """y^2 = -1, on which no state depends."""

    x: Var[Scalar, ""] = 1.0
    y: Var[Scalar, ""] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(fall=eq(d.x, -self.x, check_units=False), law=eq(self.y**2, -1.0))


class Unbounded(Component):
    """A rate that is not a number from the start if k is negative."""

    k: Param[Scalar, "1/s2"]
    x: Var[Scalar, "m"] = 1.0
    rate: Var[Scalar, "m/s"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(law=eq(self.rate, jnp.sqrt(self.k) * self.x), motion=eq(d.x, self.rate))


class ParallelGears(Component):
    """A gear beside two in series whose ratios make up its own, but for rounding."""

    first: Inertia
    one: IdealGear
    two: IdealGear
    three: IdealGear
    last: Inertia

    def connections(self) -> Connections:
        return (
            connect(self.first.b, self.one.a, self.two.a),
            connect(self.two.b, self.three.a),
            connect(self.one.b, self.three.b, self.last.a),
        )


def parallel_gears() -> ParallelGears:
    gears = {name: IdealGear(ratio=ratio) for name, ratio in (("one", 0.3), ("two", 0.1), ("three", 3.0))}
    return ParallelGears(first=Inertia(J=1.0), last=Inertia(J=2.0), **gears)


class OneWay(Component):
    """x falls from 1 to below 1/2, where it must not be."""

    x: Var[Scalar, ""] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(fall=eq(d.x, -1.0, check_units=False))

    def events(self) -> Events:
        return dict(backwards=refuse(self.x < 0.5, "it would run backwards"))


class Holder(Component):
    part: Component


def bad_resistor() -> Any:
    return eqx.tree_at(lambda m: m.r.R, rc(), jnp.asarray(-100.0))


class Run(NamedTuple):
    result: Any
    run: Callable[..., Solution]
    error: type[Exception] | None = None
    message: str = ""


def crossing(level: float) -> Callable[[Any], Any]:
    return lambda s: s.c.v - level


class Sliding(Component):
    """x falls above y and rises below it: it slides along y."""

    x: Var[Scalar, "1"] = 1.0
    y: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(
            switch=eq(d.x, ifelse(self.x > self.y, -1.0, 2.0), check_units=False),
            surface=eq(d.y, 0.3 * self.y - 0.1, check_units=False),
        )


RUNS: dict[str, Run] = {
    "reached_end": Run(Result.reached_end, lambda **k: simulate(rc(), 0.1, save="end", **k)),
    "stopped": Run(Result.stopped, lambda **k: simulate(rc(), 1.0, until=crossing(2.0), save="end", **k)),
    "never_stopped": Run(
        Result.never_stopped,
        lambda **k: simulate(rc(), 1.0, until=crossing(6.0), save="end", **k),
        SimulationError,
        r"At t = 1 s: The stop condition was never met.*throw=False",
    ),
    "too_many_steps": Run(
        Result.too_many_steps,
        lambda **k: simulate(rc(), 10.0, max_steps=4, rtol=1e-9, **k),
        SimulationError,
        r"At t = \S+ s: The maximum number of steps was reached\. Increase max_steps.*c\.v",
    ),
    "too_many_steps of what slides": Run(
        Result.too_many_steps,
        lambda **k: simulate(Sliding(), 5.0, max_steps=200, **k),
        SimulationError,
        r"The last events were an ifelse of the model, 8 within .*a switching surface.*Remedy: use an element",
    ),
    "too_many_steps of a relay": Run(
        Result.too_many_steps,
        lambda **k: simulate(Relay(), 3.0, max_steps=200, save="end", **k),
        SimulationError,
        r"At t = 1 s: .*The last events were up, down, 8 within .*a switching surface.*Remedy: .*hysteresis",
    ),
    "step_too_small": Run(
        Result.step_too_small,
        lambda **k: simulate(Holder(part=BlowUp()), 3.0, save="end", **k),
        SimulationError,
        r"At t = 1\.57\S* s: The step size fell below dtmin.*part\.x",
    ),
    "not_finite of a root": Run(
        Result.not_finite,
        lambda **k: simulate(Rootless(), 1.0, save="end", **k),
        SimulationError,
        r"At t = 0 s: A variable became infinite or not a number\. The first one is y.*have no solution there",
    ),
    "events_accumulate": Run(
        Result.events_accumulate,
        lambda **k: simulate(Rebound(e=0.5), 2.3, save="end", **k),
        SimulationError,
        r"At t = 1\.35457 s: .*ever faster.*small speed.*The last events were impact",
    ),
    "events_endless": Run(
        Result.events_endless,
        lambda **k: simulate(Undoing(), 1.0, save="end", **k),
        SimulationError,
        r"At t = 0 s: Events at one instant.*without end, as comparators .* Add a hysteresis",
    ),
    "bad_reset": Run(
        Result.bad_reset,
        lambda **k: simulate(forced_gear(), 1.0, save="end", **k),
        SimulationError,
        r"contradict the constraints.*Set fewer of them.*force",
    ),
    "refused": Run(
        Result.refused,
        lambda **k: simulate(Holder(part=OneWay()), 1.0, save="end", **k),
        SimulationError,
        r"At t = 0\.5 s: .*part.*it would run backwards",
    ),
    "history_full": Run(
        Result.history_full,
        lambda **k: simulate(Holder(part=Forgetful()), 1.0, save="end", rtol=1e-9, **k),
        SimulationError,
        r"At t = \S+ s: part\.kept: The history of a delayed signal does not reach back.*Increase the number n",
    ),
    "undetermined": Run(
        Result.undetermined,
        lambda **k: simulate(parallel_gears(), 1.0, save="end", **k),
        SimulationError,
        r"singular to within rounding errors.*one\.kinematics.*Remedy: look for.*ideal elements that fix one value",
    ),
    "not_finite": Run(
        Result.not_finite,
        lambda **k: simulate(Holder(part=Root()), 2.0, save="end", **k),
        SimulationError,
        r"At t = 2 s: A variable became infinite or not a number\. The first one is part\.root",
    ),
    "not_finite from the start": Run(
        Result.not_finite,
        lambda **k: simulate(Holder(part=Unbounded(k=-1.0)), 2.0, save="end", **k),
        SimulationError,
        r"At t = \S+ s: A variable became infinite or not a number\. The first one is part\.rate",
    ),
    "bad_parameter": Run(
        Result.bad_parameter,
        lambda **k: simulate(bad_resistor(), 0.1, save="end", **k),
        ParameterError,
        r"r\.R must be nonnegative .*NegativeResistor.*, got -100\.0 ohm",
    ),
    "bad_option": Run(
        Result.bad_option,
        lambda **k: eqx.filter_jit(lambda t1: simulate(rc(), t1, save="end", **k))(jnp.asarray(jnp.nan)),
        RuntimeError,
        r"t1 must be a finite time in s",
    ),
    "bad_start": Run(
        Result.bad_start,
        lambda **k: simulate(gear_train(2.0, w1=3.0, w2=5.0), 0.1, save="end", **k),
        SimulationError,
        r"start values contradict.*(first|second)\.w cannot have the value.*omit",
    ),
}


RESULTS = {name: getattr(Result, name) for name in RUNS if " " not in name}


def test_every_result_is_covered() -> None:
    assert set(RESULTS) == set(Result._name_to_item)  # pyright: ignore[reportAttributeAccessIssue]


@pytest.mark.thorough
@pytest.mark.parametrize("name", RUNS)
def test_result_without_an_error(name: str) -> None:
    sol = RUNS[name].run(throw=False)
    assert sol.result == RUNS[name].result
    assert [key for key, result in RESULTS.items() if sol.result == result] == [name.partition(" ")[0]]
    if name == "never_stopped":
        assert sol.t1 == jnp.inf


@pytest.mark.parametrize("name", [name for name in RUNS if RUNS[name].error is not None])
def test_error_of_a_failed_run(name: str) -> None:
    error = RUNS[name].error
    assert error is not None
    with pytest.raises(error, match="(?s)" + RUNS[name].message):
        RUNS[name].run()


@pytest.mark.thorough
def test_a_parameter_that_goes_bad_under_jit() -> None:
    @eqx.filter_jit
    def run(m: Scalar, throw: bool) -> Any:
        model = eqx.tree_at(lambda holder: holder.part.m, Holder(part=Mass(m=1.0)), m)
        return simulate(model, 0.1, save="end", throw=throw).result

    assert run(jnp.asarray(2.0), True) == Result.reached_end
    assert run(jnp.asarray(-2.0), False) == Result.bad_parameter
    with pytest.raises(RuntimeError, match=r"part\.m must be positive"):
        run(jnp.asarray(-2.0), True)


@pytest.mark.thorough
def test_a_consistent_start_is_no_bad_one() -> None:
    sol = simulate(gear_train(2.0, w1=10.0, w2=5.0), 0.1, save="end", throw=False)
    assert sol.result == Result.reached_end
    np.testing.assert_allclose(sol.final.first.w, 10.0, rtol=1e-9)
