"""Circuits with a relief valve start from rest and settle at the pressure calculated independently."""

from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq

from acausal import Component, Connections, connect, simulate
from components.hydraulic import (
    ConstantFlow,
    ConstantPressure,
    GasAccumulator,
    LaminarResistance,
    Orifice,
    PilotReliefValve,
    Pump,
    ReliefValve,
    Tank,
)
from components.rotational import ConstantSpeed

CONDUCTANCE, WIDTH, FLOW = 1e-9, 1e4, 1e-4  # of the valves, and what flows in
LEAKAGE = 1e-6  # of closed valves, as a share of their conductance
SETTINGS = [1e3, 1e5, 1.5e7, 1e8, 7e8]


def relief(cracking: float) -> ReliefValve:
    return ReliefValve(conductance=CONDUCTANCE, cracking_pressure=cracking)


def rounded(x: float) -> float:
    """S over p_t as a function of (dp - cracking)/p_t."""
    return float(np.logaddexp(0.0, x))


def passed(cracking: float) -> Any:
    """q = G [S(dp) - S(0) + leakage dp] as a function of dp, with S(dp) = p_t ln(1 + exp((dp - cracking)/p_t))."""

    def law(p: float) -> float:
        return CONDUCTANCE * (WIDTH * (rounded((p - cracking) / WIDTH) - rounded(-cracking / WIDTH)) + LEAKAGE * p)

    return law


def shared(flow: float, *laws: Any) -> float:
    """The pressure at which the flows of the ways make up the whole."""
    root: Any = brentq  # its stubs know no plain number as rtol
    return float(root(lambda p: sum(law(p) for law in laws) - flow, -1e9, 2e9, xtol=1e-6, rtol=1e-14))


def drop(cracking: float, flow: float) -> float:
    """The pressure drop of a valve that takes the whole flow."""
    return shared(flow, passed(cracking))


def settled(model: Component, t: float = 1.0) -> Any:
    return simulate(model, t, save="end").final


class InSeries(Component):
    """A flow through valves one after the other."""

    flow: ConstantFlow
    valves: tuple[ReliefValve, ...]
    tank: Tank = Tank()

    def connections(self) -> Connections:
        between = [connect(x.b, y.a) for x, y in zip(self.valves, self.valves[1:], strict=False)]
        return (
            connect(self.flow.port, self.valves[0].a),
            *between,
            connect(self.valves[-1].b, self.tank.port),
        )


@pytest.mark.parametrize("second", SETTINGS)
@pytest.mark.parametrize("first", SETTINGS)
def test_two_in_series(first: float, second: float) -> None:
    found = settled(InSeries(flow=ConstantFlow(flow=FLOW), valves=(relief(first), relief(second))))
    assert float(found.flow.port.p) == pytest.approx(drop(first, FLOW) + drop(second, FLOW), rel=1e-9)


class InParallel(Component):
    """A flow that finds several ways back."""

    flow: ConstantFlow
    ways: tuple[ReliefValve | PilotReliefValve | LaminarResistance | Orifice, ...]
    tank: Tank = Tank()

    def connections(self) -> Connections:
        return (
            connect(self.flow.port, *(way.a for way in self.ways)),
            connect(self.tank.port, *(way.b for way in self.ways)),
        )


@pytest.mark.parametrize("second", SETTINGS)
@pytest.mark.parametrize("first", SETTINGS)
def test_two_in_parallel(first: float, second: float) -> None:
    found = settled(InParallel(flow=ConstantFlow(flow=FLOW), ways=(relief(first), relief(second))))
    assert float(found.flow.port.p) == pytest.approx(shared(FLOW, passed(first), passed(second)), rel=1e-9)


@pytest.mark.parametrize("resistance", [1e6, 1e10, 1e13])
@pytest.mark.parametrize("cracking", SETTINGS)
def test_beside_a_resistance(cracking: float, resistance: float) -> None:
    """Open or closed, as the resistance leaves more or less pressure than it takes to open the valve."""
    ways = (relief(cracking), LaminarResistance(resistance=resistance))
    found = settled(InParallel(flow=ConstantFlow(flow=FLOW), ways=ways))
    wanted = shared(FLOW, passed(cracking), lambda p: p / resistance)
    assert float(found.flow.port.p) == pytest.approx(wanted, rel=1e-9, abs=1e-3)


@pytest.mark.parametrize("area", [1e-8, 1e-5])
@pytest.mark.parametrize("cracking", SETTINGS)
def test_beside_an_orifice(cracking: float, area: float) -> None:
    found = settled(
        InParallel(flow=ConstantFlow(flow=FLOW), ways=(relief(cracking), Orifice(area=area, density=860.0)))
    )

    def through(p: float) -> float:
        return 0.61 * area * np.sqrt(2.0 / 860.0) * p / (p**2 + 100.0**2) ** 0.25

    wanted = shared(FLOW, passed(cracking), through)
    assert float(found.flow.port.p) == pytest.approx(wanted, rel=1e-9, abs=1e-3)


@pytest.mark.thorough
@pytest.mark.parametrize("piloted", [5e6, 2e7])
@pytest.mark.parametrize("cracking", [1e7, 7e8])
def test_beside_a_piloted_valve(cracking: float, piloted: float) -> None:
    """The one that is set lower takes the flow: a piloted one opens in proportion to the pressure within its band."""
    pilot = PilotReliefValve(pressure=piloted, rated_flow=10.0 * FLOW, rated_drop=1e6, band=1e6)
    found = settled(InParallel(flow=ConstantFlow(flow=FLOW), ways=(relief(cracking), pilot)))

    def through(p: float) -> float:
        opening = np.clip((p - piloted) / 1e6, 0.0, 1.0)
        return 10.0 * FLOW * opening * p / (p**2 + 100.0**2) ** 0.25 / 1e3

    wanted = shared(FLOW, passed(cracking), through)
    assert float(found.flow.port.p) == pytest.approx(wanted, rel=1e-4)


class Pumped(Component):
    """A pump whose only path is the valve, at a speed that can be zero."""

    drive: ConstantSpeed
    pump: Pump
    valve: ReliefValve
    tank: Tank = Tank()

    def connections(self) -> Connections:
        return (
            connect(self.drive.flange, self.pump.shaft),
            connect(self.pump.b, self.valve.a),
            connect(self.valve.b, self.pump.a, self.tank.port),
        )


@pytest.mark.parametrize("speed", [0.0, 1e-3, 1.0, 300.0])
@pytest.mark.parametrize("cracking", SETTINGS)
def test_a_pump_that_has_no_other_way(cracking: float, speed: float) -> None:
    leakage, displacement = 1e-13, 1e-6
    pump = Pump(displacement=displacement, leakage=leakage)
    found = settled(Pumped(drive=ConstantSpeed(speed=speed), pump=pump, valve=relief(cracking)))
    wanted = shared(displacement * speed, passed(cracking), lambda p: leakage * p)
    assert float(found.valve.dp) == pytest.approx(wanted, rel=1e-9, abs=1e-3)


class Charging(Component):
    """A flow that charges an accumulator until the valve takes it."""

    flow: ConstantFlow
    accumulator: GasAccumulator
    valve: ReliefValve
    back: ConstantPressure

    def connections(self) -> Connections:
        return (
            connect(self.flow.port, self.accumulator.port, self.valve.a),
            connect(self.valve.b, self.back.port),
        )


@pytest.mark.thorough
@pytest.mark.parametrize("back", [0.0, 6e6])
@pytest.mark.parametrize("cracking", [1e3, 1e6])
def test_beside_an_accumulator(cracking: float, back: float) -> None:
    """In the end nothing flows into the accumulator; the valve adds its drop to the pressure behind it."""
    gas = GasAccumulator(capacity=2e-3, resistance=1e8, volume=2.2e-3, precharge=5e6)
    rig = Charging(
        flow=ConstantFlow(flow=FLOW), accumulator=gas, valve=relief(cracking), back=ConstantPressure(pressure=back)
    )
    assert float(settled(rig, 200.0).flow.port.p) == pytest.approx(back + drop(cracking, FLOW), rel=1e-5)


def pressure_beside_a_full_accumulator(cracking: Any, solver: Any = None) -> Any:
    gas = GasAccumulator(capacity=1e-3, resistance=1e9, volume=2e-3, precharge=5e6)
    flow = ConstantFlow(flow=FLOW)
    rig = Charging(flow=flow, accumulator=gas, valve=relief(cracking), back=ConstantPressure(pressure=0.0))
    return simulate(rig, 15.0, save="end", solver=solver).final.flow.port.p


@pytest.mark.thorough
@pytest.mark.parametrize("solver", [None, diffrax.Kvaerno5()])
@pytest.mark.parametrize("cracking", [1.5e7, 1e8])
def test_beside_an_accumulator_that_becomes_full(cracking: float, solver: Any) -> None:
    """The pressure jumps to the point at which the valve takes the whole flow, from where its law is flat."""
    pressure = jax.value_and_grad(lambda c: pressure_beside_a_full_accumulator(c, solver))
    found, slope = pressure(jnp.asarray(cracking))
    assert float(found) == pytest.approx(drop(cracking, FLOW), rel=1e-9)
    assert float(slope) == pytest.approx(1.0 / (1.0 + LEAKAGE), rel=1e-9)


@pytest.mark.thorough
def test_settings_beside_an_accumulator_that_becomes_full() -> None:
    """The slope of a closed valve falls from twice its leakage to the leakage alone."""
    settings = jnp.asarray([1.36e7, 1.4e7, 1.5e7, 2.2e7, 1e8, 5e8])
    found = jax.vmap(pressure_beside_a_full_accumulator)(settings)
    assert np.asarray(found) == pytest.approx([drop(c, FLOW) for c in settings.tolist()], rel=1e-9)
