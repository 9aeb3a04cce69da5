"""The energy account of a run, and integrals beside the states."""

import dataclasses
from typing import Any, Self

import jax
import numpy as np
import pytest
from _models import Chain, oscillator, rc

from acausal import (
    Component,
    Connections,
    Discrete,
    Energy,
    Equations,
    Events,
    ModelError,
    Param,
    Scalar,
    Solution,
    UnknownNameError,
    Var,
    connect,
    eq,
    repeat,
    simulate,
    when,
)
from components.electrical import ConstantVoltage, DCMotor, Ground
from components.rotational import Inertia, Spring, SpringDamper

END = 0.25
CHARGED = 5.0 * (1.0 - np.exp(-10.0 * END))  # V, of the capacitor at the end


@pytest.fixture(scope="module")
def charge() -> Solution:
    def rates(s: Any) -> Any:
        return {"charge": s.c.i, "heat": (s.r.v * s.r.i, 2.0)}

    return simulate(rc(), END, integrals=rates, energy=True, rtol=1e-11)


@pytest.mark.thorough
def test_account_of_a_charge(charge: Solution) -> None:
    """The source gives V Q, the capacitor keeps C v^2 / 2, the resistor turns the rest to heat."""
    account = charge.energy
    assert set(account.supplied) == {"source", "r", "c"}
    supplied, stored = 5.0 * 1e-3 * CHARGED, 0.5e-3 * CHARGED**2
    np.testing.assert_allclose(account.supplied["source"], supplied, rtol=1e-9)
    np.testing.assert_allclose(account.stored["c"], stored, rtol=1e-9)
    np.testing.assert_allclose(account.dissipated["r"], supplied - stored, rtol=1e-9)
    np.testing.assert_allclose(account.totals, (supplied, stored, supplied - stored), rtol=1e-9)
    assert abs(account.imbalance) < 1e-8 * supplied


def test_table(charge: Solution) -> None:
    lines = str(charge.energy).splitlines()
    assert lines[0].split() == ["energy", "[J]", "supplied", "stored", "dissipated"]
    cells = {line.split()[0]: line.split()[1:] for line in lines[1:-1]}
    assert set(cells) == {"source", "r", "c", "total"}
    assert cells["source"] == [f"{5e-3 * CHARGED:.6g}"]
    assert cells["c"] == [f"{0.5e-3 * CHARGED**2:.6g}"]
    assert len(cells["total"]) == 3
    assert lines[-1].startswith("imbalance: ")
    assert lines[-1].endswith(" J")


def test_the_totals_of_the_table_count_what_events_lose(charge: Solution) -> None:
    """A reader who adds up a column finds its total, whose three numbers balance."""
    lossy = dataclasses.replace(charge.energy, events={"impact": 2.0, "reset": -0.5})
    rows = [line.split() for line in str(lossy).splitlines()]
    total = next(row for row in rows if row[0] == "total")
    assert [row[1] for row in rows if row[0] in lossy.events] == ["2", "-0.5"]
    np.testing.assert_allclose(float(total[3]), charge.energy.totals[2] + 1.5, rtol=1e-5)


def test_integrals(charge: Solution) -> None:
    """They have the structure that the function returned, and a value for each saved time."""
    voltage = 5.0 * (1.0 - np.exp(-10.0 * np.asarray(charge.ts)))
    np.testing.assert_allclose(charge.integrals["charge"], 1e-3 * voltage, rtol=1e-8, atol=1e-14)
    heat, twice = charge.integrals["heat"]
    np.testing.assert_allclose(heat, 5e-3 * voltage - 0.5e-3 * voltage**2, rtol=1e-8, atol=1e-14)
    np.testing.assert_allclose(twice, 2.0 * np.asarray(charge.ts), rtol=1e-12, atol=1e-15)


def test_what_was_not_asked_for() -> None:
    sol = simulate(rc(), END)
    with pytest.raises(ModelError, match=r"integrals=\.\.\. or energy=True"):
        _ = sol.integrals


class Decay(Component):
    """A state without energy."""

    x: Var[Scalar, ""] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(decay=eq(d.x, -self.x, check_units=False))


def test_an_account_of_nothing_within_jit() -> None:
    """jax compares the structures of these two solutions, which have the same numbers."""
    for energy in (False, True):
        found = jax.jit(lambda x, energy=energy: simulate(Decay(x=x), END, save="end", energy=energy).final.x)(1.0)
        np.testing.assert_allclose(found, np.exp(-END), rtol=1e-5)


class Drive(Component):
    """A motor winds up a spring with a damper beside it."""

    source: ConstantVoltage
    motor: DCMotor
    load: Inertia
    spring: SpringDamper
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.source.p, self.motor.p),
            connect(self.source.n, self.motor.n, self.ground.p),
            connect(self.motor.shaft, self.spring.a),
            connect(self.spring.b, self.load.a),
        )


@pytest.mark.thorough
def test_account_of_a_drive_closes() -> None:
    motor = DCMotor(R=0.5, L=2e-3, k=0.04, J=3e-4, friction=1e-3)
    model = Drive(source=ConstantVoltage(V=12.0), motor=motor, load=Inertia(J=1e-3), spring=SpringDamper(c=2.0, d=0.01))
    sol = simulate(model, 0.3, energy=True, save="end", rtol=1e-11)
    account = sol.energy
    assert set(account.supplied) >= {"source", "motor.resistor", "motor.inductor", "motor.rotor", "load", "spring"}
    assert all(value >= 0.0 for value in account.dissipated.values())
    supplied, stored, dissipated = account.totals
    assert min(stored, dissipated) > 0.01 * supplied  # so that nothing closes trivially
    np.testing.assert_allclose(supplied, stored + dissipated, rtol=1e-8)
    np.testing.assert_allclose(account.stored["load"], 0.5e-3 * sol.final.load.w**2, rtol=1e-12)
    with pytest.raises(UnknownNameError, match=r"'motor' has no energy .* sum over its parts .*motor\.inductor, motor"):
        account.stored["motor"]
    with pytest.raises(UnknownNameError, match=r"'sprin' has no energy account of its own\. Did you mean spring"):
        account.dissipated["sprin"]
    assert jax.tree.map(float, jax.jit(lambda x: x)(account.stored)) == jax.tree.map(float, account.stored)


@pytest.mark.thorough
def test_damped_oscillator_loses_what_it_stored() -> None:
    sol = simulate(oscillator(m=2.0, c=50.0, d=4.0, s0=0.03), 40.0, energy=True, save="end", rtol=1e-11)
    np.testing.assert_allclose(sol.energy.dissipated["link"], 0.5 * 50.0 * 0.03**2, rtol=1e-8)
    np.testing.assert_allclose(sol.energy.stored["link"], -0.5 * 50.0 * 0.03**2, rtol=1e-8)


@pytest.mark.thorough
def test_members_of_an_array_are_summed() -> None:
    model = Chain(masses=repeat(Inertia(J=2.0, w=np.array([1.0, 0.5, -0.2])), 3), springs=repeat(Spring(c=3.0), 2))
    sol = simulate(model, 1.0, energy=True, save="end", rtol=1e-11)
    (kinetic,) = (value for name, value in sol.energy.stored.items() if name.startswith("masses"))
    (elastic,) = (value for name, value in sol.energy.stored.items() if name.startswith("springs"))
    before = np.sum(np.array([1.0, 0.5, -0.2]) ** 2)
    np.testing.assert_allclose(kinetic, np.sum(sol.final.masses.item.w**2) - before, rtol=1e-9)
    assert kinetic < -0.1
    np.testing.assert_allclose(kinetic + elastic, 0.0, atol=1e-8)


class Braked(Component):
    """A mass whose speed is halved at 1 m, and a count of that."""

    m: Param[Scalar, "kg"] = 2.0
    x: Var[Scalar, "m"] = 0.0
    v: Var[Scalar, "m/s"] = 2.0
    is_braked: Discrete[Scalar, "1"] = 0.0
    count: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(speed=eq(d.x, self.v), newton=eq(d.v, 0.0 * self.v, check_units=False))

    def events(self) -> Events:
        return dict(
            brake=when(self.x > 1.0, v=0.5 * self.v, is_braked=1.0),
            note=when(self.is_braked > 0.5, count=self.count + 1.0, is_braked=0.0),
        )

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.m * self.v**2)


def test_an_event_loses_the_energy_and_those_that_it_triggers_do_not() -> None:
    sol = simulate(Braked(), 1.0, energy=True, save="end")
    assert sol.final.count == 1.0
    assert sol.energy.events == pytest.approx({"brake": 3.0, "note": 0.0}, abs=1e-9)
    assert abs(sol.energy.imbalance) < 1e-9
