"""Solutions under transformations, stored and copied; functions of a notebook; one port joined to many."""

import copy
import math
import pickle
from collections.abc import Callable
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _models import rc

from acausal import Array as Parts
from acausal import (
    Component,
    Connections,
    Equations,
    ModelError,
    Param,
    Scalar,
    Solution,
    System,
    Var,
    choose_states,
    connect,
    eq,
    linearise,
    repeat,
    replace,
    simulate,
    structure,
)
from acausal._evaluate.building import system_of
from components.electrical import Capacitor, ConstantVoltage, Ground, Pin, Resistor
from components.translational import ConstantForce, HardStop, Mass

READINGS: dict[str, Callable[[Solution], Any]] = {
    "by name": lambda sol: sol["c.v"],
    "by attribute": lambda sol: sol.c.v,
    "times": lambda sol: sol.ts,
    "states": lambda sol: sol.ys,
    "end": lambda sol: sol.final.c.v,
    "at": lambda sol: sol.at(jnp.array([0.02, 0.05])).c.v,
}
SAVES: dict[str, Any] = {"steps": "steps", "times": np.linspace(0.0, 0.1, 5), "dense": "dense"}
CASES = [(r, s) for r in READINGS for s in SAVES if r != "at" or s == "dense"]


@pytest.mark.thorough
@pytest.mark.parametrize(("reading", "save"), CASES)
def test_readings_are_differentiable(reading: str, save: str) -> None:
    """Eagerly in both modes, with the shape that the reading has outside."""
    read = lambda R: READINGS[reading](simulate(rc(R=R), 0.1, save=SAVES[save]))  # noqa: E731
    total = lambda R: jnp.sum(read(R))  # noqa: E731
    value, slope = jax.jvp(total, (100.0,), (1.0,))
    assert jax.jvp(read, (100.0,), (1.0,))[1].shape == jax.jacfwd(read)(100.0).shape == read(100.0).shape
    np.testing.assert_allclose(value, total(100.0), rtol=1e-12)
    np.testing.assert_allclose(jax.value_and_grad(total)(100.0), (value, slope), rtol=1e-9, atol=1e-15)
    if save == "times" and reading in ("by name", "by attribute"):
        tau, t = 0.1, SAVES["times"]  # v = 5 (1 - exp(-t / tau)), and d tau / dR = C
        assert slope == pytest.approx(np.sum(-5.0 * np.exp(-t / tau) * t / tau**2) * 1e-3, rel=1e-5)


@pytest.mark.thorough
@pytest.mark.parametrize("reading", ["by name", "by attribute", "end"])
def test_readings_of_a_batch(reading: str) -> None:
    read = lambda R: READINGS[reading](simulate(rc(R=R), 0.1, save=SAVES["times"]))  # noqa: E731
    R = jnp.array([50.0, 100.0])
    np.testing.assert_allclose(jax.vmap(read)(R), jnp.stack([read(r) for r in R]), rtol=1e-5)
    np.testing.assert_allclose(jax.vmap(jax.jacfwd(read))(R), jnp.stack([jax.jacfwd(read)(r) for r in R]), rtol=1e-3)


class Bouncing(Component):
    """A mass that is pushed against a stop: s = a t^2 / 2 until it is there."""

    mass: Mass
    push: ConstantForce
    stop: HardStop

    def connections(self) -> Connections:
        return (connect(self.mass.b, self.push.flange, self.stop.flange),)


def bouncing() -> Bouncing:
    return Bouncing(
        mass=Mass(m=1.0), push=ConstantForce(force=1.0), stop=HardStop(s_max=0.3, restitution=0.5, rest=0.1)
    )


@pytest.mark.thorough
def test_logs_and_trajectories_through_events_are_differentiable() -> None:
    names: list[list[str]] = []

    def speeds(force: Any) -> Any:
        sol = simulate(replace(bouncing(), {"push.force": force}), 2.0)
        names.append(sol.events.names)
        assert len(str(sol.events).splitlines()) == 1 + len(sol.events) == 1 + len(names[-1])
        return sol["mass.v"][jnp.argmax(sol["mass.v"])], sol.events.times[0]

    speed, time = speeds(1.0)
    assert speed == pytest.approx(math.sqrt(0.6), rel=1e-6)
    assert time == pytest.approx(math.sqrt(0.6), rel=1e-6)
    for jacobian in (jax.jacfwd, jax.jacrev):
        d_speed, d_time = jacobian(speeds)(1.0)
        assert d_speed == pytest.approx(0.5 * math.sqrt(0.6), rel=1e-5)
        assert d_time == pytest.approx(-0.5 * math.sqrt(0.6), rel=1e-5)
    assert names[0]
    assert all(found == names[0] for found in names)


@pytest.mark.thorough
def test_log_of_a_batch_has_no_names() -> None:
    force = jnp.array([1.0, 2.0])
    log = jax.vmap(lambda f: simulate(replace(bouncing(), {"push.force": f}), 2.0).events)(force)
    with pytest.raises(ModelError, match="single run"):
        _ = log.names
    np.testing.assert_allclose(log.of_event("stop.impact_high")[:, 0], np.sqrt(0.6 / force), rtol=1e-6)
    with pytest.raises(ModelError, match=r"no event 'stop.impact'. Did you mean stop.impact_"):
        log.of_event("stop.impact")


@pytest.mark.thorough
def test_log_of_a_model_without_events() -> None:
    sol = simulate(rc(), 0.1)
    assert (len(sol.events), sol.events.names, sol.events.count) == (0, [], 0)
    assert str(sol.events) == f"{'time [s]':>14}  event"
    batch = jax.vmap(lambda R: simulate(rc(R=R), 0.1).events)(jnp.ones(3))
    assert batch.times.shape == (3, 0)


@pytest.mark.thorough
def test_functions_may_use_arrays_of_the_notebook() -> None:
    times, levels = np.linspace(0.0, 0.2, 6), np.linspace(0.0, 4.0, 6)
    until = lambda s: s.c.v - jnp.interp(s.c.v, levels, times) - 2.0  # noqa: E731
    integrals = lambda s: {"weighted": jnp.dot(levels[:2], jnp.stack([s.c.v, s.c.v]))}  # noqa: E731
    sol = simulate(rc(), 0.2, until=until, integrals=integrals)
    assert sol.final.c.v == pytest.approx(2.0 / 0.95, rel=1e-6)
    charge = 5.0 * (sol.t1 - 0.1 * (1.0 - math.exp(-sol.t1 / 0.1)))
    assert sol.integrals["weighted"][-1] == pytest.approx(float(0.8 * charge), rel=1e-5)


COPIES: dict[str, Callable[[Any], Any]] = {
    "deepcopy": copy.deepcopy,
    "pickle": lambda value: pickle.loads(pickle.dumps(value)),
}


@pytest.mark.thorough
@pytest.mark.parametrize("again", COPIES)
@pytest.mark.parametrize("save", ["steps", "dense"])
@pytest.mark.parametrize("model", [rc(), bouncing()], ids=["smooth", "with events"])
def test_copies_of_solutions(model: Component, save: str, again: str) -> None:
    sol = simulate(model, 1.0, save=save, energy=True, integrals=lambda s: {"one": 1.0})
    same: Solution = COPIES[again](sol)
    assert same.result == sol.result
    assert str(same.energy) == str(sol.energy)
    assert same.events.names == sol.events.names
    np.testing.assert_array_equal(same.integrals["one"], sol.integrals["one"])
    for name, values in sol.to_numpy().items():
        np.testing.assert_array_equal(same.to_numpy()[name], values)
    if save == "dense":
        np.testing.assert_array_equal(jax.tree_util.tree_leaves(same.at(0.5)), jax.tree_util.tree_leaves(sol.at(0.5)))
    once, rerun = simulate(model, 1.0, save="end"), simulate(COPIES[again](model), 1.0, save="end", system=same.system)
    np.testing.assert_array_equal(jax.tree_util.tree_leaves(rerun.final), jax.tree_util.tree_leaves(once.final))


@pytest.mark.thorough
@pytest.mark.parametrize("algebraic", ["solve", "integrate"])
def test_systems_are_built_again_from_what_is_stored(algebraic: Any) -> None:
    """As in another process, in which nothing is built yet."""
    system = choose_states(rc(), algebraic=algebraic)
    other: System = pickle.loads(pickle.dumps(system))
    assert other is not system
    assert other.state_names == system.state_names
    assert str(structure(other)) == str(structure(system))
    ends = [simulate(rc(), 0.1, system=each, save="end").final.c.v for each in (system, other)]
    assert ends[0] == ends[1]


def test_systems_of_classes_are_shared() -> None:
    system = simulate(rc(), 0.1).system
    assert copy.deepcopy(system) is copy.copy(system) is system
    assert pickle.loads(pickle.dumps(system)) is system


class Weighted(Component):
    """A decay at the sum of some rates."""

    rates: Param[Any, "1/s"]
    x: Var[Scalar, ""] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(decay=eq(d.x, -jnp.sum(self.rates) * self.x))


@pytest.mark.thorough
def test_systems_are_shared_after_many_other_models() -> None:
    model = Weighted(rates=np.ones(1))
    system = system_of(model)
    for n in range(2, 300):
        system_of(Weighted(rates=np.ones(n)))
        assert system_of(model) is system
    assert pickle.loads(pickle.dumps(system)) is system


def test_linear_systems_can_be_stored() -> None:
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(linearise(rc()))).A, linearise(rc()).A)


class Bank(Component):
    """Capacitors in parallel, each behind its own resistor."""

    resistors: Parts[Resistor]
    capacitors: Parts[Capacitor]
    p: Pin = Pin()
    n: Pin = Pin()

    def connections(self) -> Connections:
        return (
            connect(self.p, self.resistors[:].p),
            connect(self.resistors[:].n, self.capacitors[:].p),
            connect(self.capacitors[:].n, self.n),
        )


class Banks(Component):
    """Banks in parallel at a source."""

    source: ConstantVoltage
    banks: Parts[Bank]
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.banks[:].p, self.source.p),
            connect(self.ground.p, self.source.n, self.banks[:].n),
        )


@pytest.mark.thorough
def test_one_port_joined_to_many() -> None:
    """i = sum of V / R exp(-t / (R C)) over all branches."""
    R = jnp.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    bank = Bank(resistors=repeat(Resistor(R=R[0]), 3), capacitors=repeat(Capacitor(C=1.0), 3))
    banks = replace(repeat(bank, 2), {"item.resistors.item.R": R})
    sol = simulate(Banks(source=ConstantVoltage(V=12.0), banks=banks), 1.0, save="end")
    assert -sol.final.source.p.i == pytest.approx(float(jnp.sum(12.0 / R * jnp.exp(-1.0 / R))), rel=1e-5)


class Uneven(Component):
    some: Parts[Resistor]
    others: Parts[Resistor]

    def connections(self) -> Connections:
        return (connect(self.some[:].p, self.others[:].p),)


@pytest.mark.thorough
def test_arrays_of_different_length_cannot_be_joined() -> None:
    model = Uneven(some=repeat(Resistor(R=1.0), 2), others=repeat(Resistor(R=1.0), 3))
    with pytest.raises(ModelError, match=r"2 and 3 ports.*or a single one"):
        simulate(model, 1.0)
