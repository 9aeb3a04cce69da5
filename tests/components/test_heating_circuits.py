"""Heat exchangers, radiators and thermostats, and the warm-up of an oil circuit, against closed forms."""

import itertools
from typing import Any

import jax
import numpy as np
import pytest
import scipy.linalg
from _rig import Rig

from acausal import Component, Connections, ParameterError, connect, simulate
from acausal.testing import check_law
from components.hydraulic import (
    CirculationPump,
    ConstantFlow,
    Cooler,
    CounterFlow,
    CrossFlow,
    FixedPump,
    HeatExchanger,
    ParallelFlow,
    Radiator,
    ReliefValve,
    ShellAndTube,
    Tank,
    ThermostaticValve,
    Vessel,
    WilsonLosses,
    fill,
    iso_vg_46,
    water,
)
from components.rotational import ConstantSpeed
from components.thermal import FixedTemperature, HeatPort, ThermalConductor

WATER = water(temperature=293.15, carries_heat=True)
HEAT = float(WATER.reference_density) * 4182.0  # J/(m3.K)


def passed(N: float, c: float, ways: list[float]) -> float:
    """Effectiveness of a stream in equal passes with (1) or against (-1) the other one, from their balances of heat.

    The tubes carry C_min: way dt/dx = N/k (T - t) in each of k passes, and dT/dx = c N/k (t - T) summed over them in
    the shell, a linear boundary value problem on 0 .. 1.
    """
    k = len(ways)
    matrix = np.zeros((k + 1, k + 1))
    for i, way in enumerate(ways, start=1):
        matrix[0, [0, i]] += c * N / k * np.array([-1.0, 1.0])
        matrix[i, [0, i]] += way * N / k * np.array([1.0, -1.0])
    through = scipy.linalg.expm(matrix)
    # The shell stream enters at x = 0 with 1; the tubes enter with 0 and turn at the ends, in the order of the passes.
    rows, values = [np.eye(k + 1)[0]], [1.0]
    ends = [(np.eye(k + 1)[i], through[i]) for i in range(1, k + 1)]
    for i, way in enumerate(ways):
        inlet = ends[i][0] if way > 0 else ends[i][1]
        before = 0.0 if i == 0 else (ends[i - 1][1] if ways[i - 1] > 0 else ends[i - 1][0])
        rows.append(inlet - before)
        values.append(0.0)
    start = np.linalg.solve(np.array(rows), np.array(values))
    return float((ends[-1][1] if ways[-1] > 0 else ends[-1][0]) @ start)


@pytest.mark.parametrize(
    ("arrangement", "ways"),
    [(CounterFlow(), [-1.0]), (ParallelFlow(), [1.0]), (ShellAndTube(), [1.0, -1.0])],
    ids=["counter", "parallel", "shell"],
)
def test_effectiveness_solves_the_balances_of_both_streams(arrangement: Any, ways: list[float]) -> None:
    for N, c in itertools.product((0.5, 1.0, 3.0), (1e-6, 0.5, 0.999)):
        assert float(arrangement.effectiveness(N, c)) == pytest.approx(passed(N, c, ways), rel=1e-6)
    assert float(arrangement.effectiveness(2.0, 0.0)) == pytest.approx(-np.expm1(-2.0), rel=1e-12)
    slope = jax.grad(arrangement.effectiveness, argnums=1)
    np.testing.assert_allclose(slope(2.0, 1.0), slope(2.0, 1.0 - 1e-9), rtol=1e-6)


def test_cross_flow_agrees_with_the_series_of_both_streams_unmixed() -> None:
    """Mason's solution: e = (1/(N c)) sum over n of P_n(N) P_n(N c), P_n(x) = 1 - exp(-x) sum x^m/m! for m <= n."""

    def exact(N: float, c: float) -> float:
        def missing(x: float) -> np.ndarray:
            terms = np.cumprod(np.concatenate([[1.0], x / np.arange(1.0, 60.0)]))
            return 1.0 - np.exp(-x) * np.cumsum(terms)

        return float(np.sum(missing(N) * missing(N * c)) / (N * c))

    for N in (0.5, 1.0, 2.0, 4.0):
        for c in (0.25, 0.5, 1.0):
            assert float(CrossFlow().effectiveness(N, c)) == pytest.approx(exact(N, c), rel=0.035)
    assert float(CrossFlow().effectiveness(2.0, 0.0)) == pytest.approx(-np.expm1(-2.0), rel=1e-12)


@pytest.mark.parametrize(
    ("arrangement", "effectiveness", "NTU"),
    [
        (CounterFlow(), 0.8748, 100.0 / 30.0),
        (CounterFlow(), 0.74, 57.01 / 30.0),
        (ParallelFlow(), 0.6136, 2.5),
        (ParallelFlow(), 0.61, 69.93 / 30.0),
        (CrossFlow(), 0.7632, 2.5),
        (CrossFlow(), 0.61, 40.23 / 30.0),
    ],
)
def test_printed_values_of_the_effectiveness(arrangement: Any, effectiveness: float, NTU: float) -> None:
    """Heat exchanger library of EES after Nellis, Klein, `Heat Transfer`: streams of 50 and 30 W/K, UA in W/K."""
    assert float(arrangement.effectiveness(NTU, 0.6)) == pytest.approx(effectiveness, abs=5e-5)


def test_a_printed_double_pipe_oil_cooler() -> None:
    """Incropera, DeWitt, example 11.1: 8524 W from oil at 100 C to water at 30 C, log mean difference 43.2 K."""
    oil, water = 0.1 * 2131.0, 0.2 * 4178.0
    NTU = 8524.0 / 43.2 / oil
    heat = float(CounterFlow().effectiveness(NTU, oil / water)) * oil * (100.0 - 30.0)
    assert heat == pytest.approx(8524.0, rel=1e-3)


def exchanging(hot: Any, bath: Any, cold: Any, exchanger: Any, out_1: Any, out_2: Any) -> Connections:
    return (
        connect(hot.heat, bath.port),
        connect(hot.port, exchanger.a_1),
        connect(exchanger.b_1, out_1.port),
        connect(cold.port, exchanger.a_2),
        connect(exchanger.b_2, out_2.port),
    )


def test_a_heat_exchanger_of_two_equal_streams() -> None:
    """In counterflow with c = 1 and N = 1 half of the difference is exchanged, and heat is conserved."""
    q = 1e-4
    exchanger = HeatExchanger(UA=HEAT * q, resistance_1=0.0, resistance_2=0.0, arrangement=CounterFlow())
    parts = (
        ConstantFlow(flow=q, heat=HeatPort()),
        FixedTemperature(temperature=353.15),
        ConstantFlow(flow=q),
        exchanger,
        Tank(),
        Tank(),
    )
    solution = simulate(fill(Rig(parts=parts, wiring=exchanging), WATER), 1.0, save="end", energy=True)
    found: Any = solution.final.parts[3]
    np.testing.assert_allclose([found.outlet_1.T, found.outlet_2.T], [323.15, 323.15], atol=1e-4)
    np.testing.assert_allclose(found.Q_flow, 30.0 * HEAT * q, rtol=1e-6)
    assert abs(solution.energy.imbalance) < 1e-6 * 30.0 * HEAT * q


class OilCircuit(Component):
    """A pump feeds a relief valve; the oil returns through a cooler into the tank, from which the pump draws it."""

    motor: ConstantSpeed
    pump: FixedPump
    relief: ReliefValve
    cooler: Cooler
    coolant: FixedTemperature
    tank: Vessel
    wall: ThermalConductor
    room: FixedTemperature

    def connections(self) -> Connections:
        tank: Any = self.tank
        return (
            connect(self.motor.flange, self.pump.shaft),
            connect(tank.ports[0], self.pump.a),
            connect(self.pump.b, self.relief.a),
            connect(self.relief.b, self.cooler.a),
            connect(self.cooler.b, tank.ports[1]),
            connect(self.cooler.coolant, self.coolant.port),
            connect(tank.heat, self.wall.a),
            connect(self.wall.b, self.room.port),
        )


OIL = iso_vg_46(temperature=293.15, carries_heat=True)


def oil_circuit(UA: Any = 150.0, losses: WilsonLosses | None = None) -> OilCircuit:
    model = OilCircuit(
        motor=ConstantSpeed(speed=150.0),
        pump=FixedPump(displacement=2e-6, liquid=iso_vg_46(), losses=losses or WilsonLosses()),
        relief=ReliefValve(cracking_pressure=100e5, conductance=1e-8),
        cooler=Cooler(resistance=1e8, UA=UA),
        coolant=FixedTemperature(temperature=293.15),
        tank=Vessel(area=0.1, density=OIL.reference_density, height=0.6, heights=[0.0, 0.0], h=0.4, heat=HeatPort()),
        wall=ThermalConductor(G=20.0),
        room=FixedTemperature(temperature=293.15),
    )
    return fill(model, OIL)


@pytest.mark.slow
def test_warm_up_of_an_oil_circuit() -> None:
    """By hand: C dT/dt = P - G (T - T_room) - Q, with the power P of the motor and the heat Q of the cooler.

    The cooler sees the tank's temperature plus P/(rho c q), so Q = e rho c q (T + P/(rho c q) - T_coolant): the oil
    approaches T_room + P (1 - e)/(G + e rho c q) with the time constant C/(G + e rho c q).
    """
    times = np.array([600.0, 1800.0, 3600.0])
    solution = simulate(oil_circuit(), 3600.0, save=times, energy=True, rtol=1e-8)
    final: Any = solution.final
    q, power = final.pump.q, -final.motor.flange.tau * 150.0
    capacity = float(OIL.reference_density) * 1950.0
    rate = capacity * q
    e = -np.expm1(-150.0 / rate)
    heat_capacity, conductance = capacity * 0.1 * (0.4 + 1e-3 * 0.6), 20.0 + e * rate
    rise = power * (1.0 - e) / conductance
    expected = 293.15 + rise * -np.expm1(-times * conductance / heat_capacity)
    assert 15.0 < rise < 60.0
    np.testing.assert_allclose(solution["tank.heat.T"], expected, atol=2e-3 * rise)
    assert abs(solution.energy.imbalance) < 1e-6 * power * 3600.0


@pytest.mark.slow
def test_the_gradient_of_the_peak_temperature() -> None:
    """The hottest oil is behind the relief valve; its viscosity follows, and so does the power of the pump."""

    def hottest(s: Any) -> Any:
        return s.relief.heat.T

    def peak(UA: Any) -> Any:
        model = oil_circuit(UA, WilsonLosses(C_s=2e-9, C_v=1e5, C_f=0.02))
        return simulate(model, 1800.0, save="end", rtol=1e-9, peaks=hottest).peaks.value

    slope = jax.jit(jax.grad(peak))(150.0)
    differences = (peak(151.0) - peak(149.0)) / 2.0
    assert float(slope) < 0.0
    np.testing.assert_allclose(slope, differences, rtol=1e-4)


def radiating(source: Any, bath: Any, radiator: Any, room: Any, tank: Any) -> Connections:
    return (
        connect(source.heat, bath.port),
        connect(source.port, radiator.a),
        connect(radiator.b, tank.port),
        connect(radiator.room, room.port),
    )


def test_a_radiator_at_its_data_sheet() -> None:
    """EN 442: 75 C in, 65 C out, 20 C room, which is an excess of 50 K; then half the flow, by the balance of heat."""
    nominal = 1000.0
    for share in (1.0, 0.5):
        q = share * nominal / (HEAT * 10.0)
        parts = (
            ConstantFlow(flow=q, heat=HeatPort()),
            FixedTemperature(temperature=348.15),
            Radiator(Q_nominal=nominal, volume=2e-3),
            FixedTemperature(temperature=293.15),
            Tank(),
        )
        found: Any = simulate(fill(Rig(parts=parts, wiring=radiating), WATER), 2e4, save="end").final.parts[2]
        output, leaving = -float(found.room.Q_flow), float(found.heat.T)
        excess = 0.5 * (348.15 + leaving) - 293.15
        assert output == pytest.approx(nominal * (excess / 50.0) ** 1.3, rel=1e-5)
        assert output == pytest.approx(HEAT * q * (348.15 - leaving), rel=1e-3)
        if share == 1.0:
            assert output == pytest.approx(nominal, rel=1e-3)


def test_a_circulation_pump_and_a_thermostatic_valve() -> None:
    """Three quarters of dp_max at half of q_max; the opening follows the temperature, with either sense."""
    pump = CirculationPump(dp_max=4e4, q_max=1e-3, power=20.0)
    rise = np.array([4e4, 3e4, 0.0, 8e4])
    check_law(pump, given={"q": np.array([0.0, 0.5e-3, 1e-3, -1e-3]), "a.p": 1e5}, expected={"b.p": 1e5 + rise})
    given = {"x": 0.25, "sensor.T": np.array([292.0, 293.5, 296.0]), "dp": 1e4}
    data: dict[str, Any] = dict(rated_flow=5e-5, rated_drop=1e4, T_closed=294.0, tau=100.0, leakage=0.0)
    for sense, targets in ((1.0, np.array([1.0, 0.25, 0.0])), (-1.0, np.array([0.0, 0.0, 1.0]))):
        expected = {"der(x)": (targets - 0.25) / 100.0, "q": 0.25 * 5e-5}
        check_law(ThermostaticValve(sense=sense, **data), given=given, expected=expected, rtol=1e-4)


def test_what_heating_parts_refuse() -> None:
    with pytest.raises(ParameterError, match=r"power must be at least 0\.385 dp_max q_max, the largest work"):
        CirculationPump(dp_max=4e4, q_max=1e-3, power=15.0)
    with pytest.raises(ParameterError, match="sense must be 1 or -1"):
        ThermostaticValve(rated_flow=5e-5, rated_drop=1e4, T_closed=294.0, sense=0.5)
