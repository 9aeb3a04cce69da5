"""The proportional valve of a clutch, and the valve that charges an accumulator."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Connections, ParameterError, connect, initialise, linearise, quantity, replace, simulate
from acausal.testing import check_law
from components.blocks import TimeSeries
from components.hydraulic import (
    Chamber,
    ChargingValve,
    CheckValve,
    ConstantFlow,
    ConstantPressure,
    GasAccumulator,
    LinearLiquid,
    Orifice,
    ProportionalReducingValve,
    Tank,
)

VALVE: dict[str, Any] = dict(
    rated_flow=2e-4, rated_drop=5e5, pressure=20e5, band=1e5, dead_band=0.2, transition_pressure=1.0
)


def test_characteristic_of_the_reducing_valve() -> None:
    """No pressure within the dead band, all of it at full command; both edges closed where the pressure is met."""
    u = np.array([0.0, 0.2, 0.6, 1.0, 1.5, 0.6, 0.6])
    wanted = np.array([0.0, 0.0, 10e5, 20e5, 20e5, 10e5, 10e5])
    error = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.5e5, -3e5])
    x = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.5, -1.0])  # the spool in balance; at most at the end of its stroke
    a, k = wanted - error, 2e-4 / np.sqrt(5e5)
    given = {"u.value": u, "a.p": a, "p.p": 30e5, "t.p": 0.0, "x": x, "v": 0.0}
    flows = {"q_pa": k * np.maximum(x, 0.0) * np.sqrt(30e5 - a), "q_at": k * np.maximum(-x, 0.0) * np.sqrt(a)}
    check_law(ProportionalReducingValve(**VALVE), given, flows | {"der(v)": 0.0, "der(x)": 0.0}, rtol=1e-6, atol=1e-9)


class Clutch(Component):
    """A clutch chamber behind the valve."""

    command: TimeSeries
    valve: ProportionalReducingValve
    chamber: Chamber
    leak: Orifice
    supply: ConstantPressure
    tank: Tank = Tank()

    def connections(self) -> Connections:
        return (
            connect(self.command.y, self.valve.u),
            connect(self.supply.port, self.valve.p),
            connect(self.valve.a, self.chamber.port, self.leak.a),
            connect(self.leak.b, self.valve.t, self.tank.port),
        )


def clutch(leak: float) -> Clutch:
    """Filled from 10 ms on, emptied from 200 ms on."""
    return Clutch(
        command=TimeSeries(
            times=[0.0, 0.01, 0.011, 0.2, 0.201, 0.5], values=[0.0, 0.0, 0.6, 0.6, 0.0, 0.0], smooth=False
        ),
        valve=ProportionalReducingValve(**VALVE),
        chamber=Chamber(volume=2e-4, liquid=LinearLiquid(density=850.0, bulk_modulus=1e9), wall=1e-7, p=0.0),
        leak=Orifice(area=leak, density=850.0),
        supply=ConstantPressure(pressure=30e5),
    )


@pytest.mark.thorough
def test_a_clutch_is_filled_and_emptied() -> None:
    run = simulate(clutch(1e-9), 0.5)
    pressure = np.asarray(run.at(np.array([0.005, 0.19, 0.49])).chamber.p)
    np.testing.assert_allclose(pressure[1], 10e5, atol=0.02e5)
    assert abs(pressure[0]) < 1e4
    assert abs(pressure[2]) < 1e4
    assert abs(run.energy.imbalance) < 1e-4 * run.energy.totals[0]


def test_the_pressure_falls_along_the_band_with_the_flow() -> None:
    """In balance x = (p_set - p)/band, and the flow through the edge is that through the leak."""
    model, area = clutch(4e-6), 4e-6
    p = float(simulate(model, 0.19, rtol=1e-8, save="end").final.chamber.p)
    through = 0.61 * area * np.sqrt(2.0 * p / 850.0)
    edge = 2e-4 / np.sqrt(5e5) * (10e5 - p) / 1e5 * np.sqrt(30e5 - p)
    assert through == pytest.approx(edge, rel=1e-3)


@pytest.mark.thorough
def test_the_filling_is_differentiable_by_the_band() -> None:
    def filled(band: Any) -> Any:
        return simulate(replace(clutch(4e-6), {"valve.band": band}), 0.03, rtol=1e-10, save="end").final.chamber.p

    slope = jax.grad(filled)(jnp.asarray(1e5))
    difference = (filled(1.01e5) - filled(0.99e5)) / 2e3
    np.testing.assert_allclose(slope, difference, rtol=1e-3)


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_the_condition_of_stability(share: float) -> None:
    """K sqrt(dp)/(C band) at this share of 2 D w, with so small a leak that it damps next to nothing."""
    flow = 2e-4 * np.sqrt(20e5 / 5e5)  # of an open edge, from 30 bar to the set pressure of 10 bar
    capacity = flow / (1e5 * share * 2.0 * 0.8 * 400.0)
    start = replace(clutch(1e-12), {"command.values": np.full(6, 0.6), "chamber.wall": capacity / 2e-4 - 1e-9})
    steady = initialise(start, steady=True)
    assert steady.chamber.p == pytest.approx(10e5, rel=1e-3)
    growth = np.max(np.real(linearise(steady).poles))
    assert (growth > 0) == (share > 1.0), growth


def test_a_dead_band_of_the_whole_command() -> None:
    with pytest.raises(ParameterError, match="dead_band must be below 1"):
        replace(ProportionalReducingValve(**VALVE), {"dead_band": 1.0})


class Charging(Component):
    """A pump charges an accumulator, from which a consumer draws."""

    pump: ConstantFlow
    valve: ChargingValve
    outlet: Chamber
    check: CheckValve
    accumulator: GasAccumulator
    consumer: Orifice
    tank: Tank = Tank()

    def connections(self) -> Connections:
        return (
            connect(self.tank.port, self.valve.b, self.consumer.b),
            connect(self.pump.port, self.outlet.port, self.valve.a, self.check.a),
            connect(self.check.b, self.accumulator.port, self.valve.pilot, self.consumer.a),
        )


@pytest.mark.thorough
def test_the_charging_valve_keeps_the_pressure_between_its_limits() -> None:
    model = Charging(
        pump=ConstantFlow(flow=quantity(6.0, "l/min")),
        valve=ChargingValve(rated_flow=2e-4, rated_drop=2e5, low=25e5, high=30e5),
        outlet=Chamber(volume=2e-5, liquid=LinearLiquid(density=850.0, bulk_modulus=1e9), p=20e5),
        check=CheckValve(conductance=2e-9),
        accumulator=GasAccumulator(capacity=1.5e-4, resistance=2e8, volume=2e-4, precharge=12e5, p=20e5),
        consumer=Orifice(area=2e-7, density=850.0),
    )
    run = simulate(model, 4.0)
    names, times = run.events.of("valve").names, run.events.of("valve").times
    assert [name.rpartition(".")[2] for name in names[:4]] == ["unloads", "charges", "unloads", "charges"]
    at = run.at(np.asarray(times[:4])).valve.pilot.p
    np.testing.assert_allclose(at, [30e5, 25e5, 30e5, 25e5], rtol=1e-5)
    # Unloaded, the pump works against the drop of the open valve only.
    just_before = run.at(np.asarray(times[1:2]) - 1e-3).outlet.p
    np.testing.assert_allclose(just_before, 2e5 * (1e-4 / 2e-4) ** 2, rtol=1e-2)


def test_limits_of_the_charging_valve() -> None:
    with pytest.raises(ParameterError, match="low must be smaller than high"):
        ChargingValve(rated_flow=2e-4, rated_drop=2e5, low=30e5, high=30e5)
