"""Valves moved by pressures, rods and signals, against closed forms."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Part, Rig

from acausal import Connections, ParameterError, connect, simulate
from acausal.testing import check_law
from components.blocks import Play, SecondOrder, Sine, Step
from components.hydraulic import (
    BypassCompensator,
    CounterbalanceValve,
    DecelerationValve,
    FourWaySpool,
    FourWayValve,
    MeteringEdge,
    PilotReliefValve,
    PilotStage,
    ProportionalValve,
    PurgeValve,
    ReliefValve,
    SequenceValve,
    ServoValve,
    SixWayValve,
    UnloadingValve,
)

RATED: dict[str, Any] = dict(rated_flow=5e-4, rated_drop=3.5e6)
K = 5e-4 / np.sqrt(3.5e6)
PILOTED: dict[str, Any] = RATED | dict(band=1e6, tau=2e-3)


def test_relief_valves() -> None:
    """Above cracking, in proportion, besides the leakage; a pilot-operated one is open at cracking + band, and in
    between by its share.
    """
    dp = np.array([1e7, 1.99e7, 2.1e7, 3e7])
    q = 1e-9 * (np.maximum(dp - 2e7, 0.0) + 1e-6 * dp)
    check_law(ReliefValve(conductance=1e-9, cracking_pressure=2e7), {"dp": dp}, {"q": q}, atol=1e-9)
    pilot = PilotReliefValve(pressure=2e7, **PILOTED)
    dp, x = np.array([1.9e7, 2.05e7, 2.1e7, 3e7]), np.array([0.0, 0.5, 1.0, 1.0])
    check_law(pilot, {"dp": dp, "x": x}, {"der(x)": np.zeros(4), "q": x * K * np.sqrt(dp)}, rtol=1e-8, atol=1e-8)


def test_sequence_valve_does_not_feel_what_is_behind_it() -> None:
    valve = SequenceValve(pressure=1e7, **PILOTED)
    for behind in (0.0, 9e6):
        given = {"a.p": np.array([9.9e6, 1.025e7, 1.2e7]), "b.p": behind, "x": 0.0}
        check_law(valve, given, {"der(x)": np.array([0.0, 0.25, 1.0]) / 2e-3, "q": 0.0}, atol=1e-6)


def test_unloading_valve_feels_its_pilot_only() -> None:
    valve, pilot = UnloadingValve(pressure=1e7, **PILOTED), np.array([9.9e6, 1.025e7, 1.2e7])
    for ahead in (0.0, 3e6):
        given = {"a.p": ahead, "b.p": 0.0, "pilot.p": pilot, "x": 0.5}
        wanted = {"der(x)": (np.array([0.0, 0.25, 1.0]) - 0.5) / 2e-3, "q": 0.5 * K * np.sqrt(ahead), "pilot.q": 0.0}
        check_law(valve, given, wanted, rtol=1e-8, atol=1e-8)


def test_counterbalance_valve() -> None:
    """The load alone opens it at 200 bar; a pilot of 40 bar on four times the area, from 40 bar of the load on."""
    valve = CounterbalanceValve(pressure=2e7, ratio=4.0, **PILOTED)
    load, pilot = np.array([1.9e7, 2.05e7, 3.9e6, 4.5e6, 1.5e7]), np.array([0.0, 0.0, 4e6, 4e6, 5e6])
    target = np.array([0.0, 0.5, 0.0, 0.5, 1.0])
    given = {"a.p": load, "b.p": 0.0, "pilot.p": pilot, "x": target}
    check_law(valve, given, {"der(x)": 0.0, "q": target * K * np.sqrt(load), "pilot.q": 0.0}, rtol=1e-8, atol=1e-8)


def test_bypass_compensator_keeps_a_margin() -> None:
    """At 20 bar above the load it begins to open, and what it lets pass is driven by the pump's whole pressure."""
    valve = BypassCompensator(margin=2e6, **PILOTED)
    given = {
        "a.p": np.array([7.9e6, 8.5e6, 1e7]),
        "load.p": 6e6,
        "b.p": 0.0,
        "x": np.array([0.0, 0.5, 1.0]),
    }
    flows = given["x"] * K * np.sqrt(given["a.p"])
    check_law(valve, given, {"der(x)": 0.0, "q": flows, "load.q": 0.0}, rtol=1e-8, atol=1e-8)


def test_purge_valve_opens_the_lower_side() -> None:
    valve = PurgeValve(threshold=5e5, band=1e6, transition_pressure=1e-2, **RATED)
    a, b = np.array([2e6, 2.4e6, 3e6, 9e6, 2e6]), np.array([2e6, 2e6, 2e6, 2e6, 9e6])
    lower = K * np.sqrt(1.5e6) * np.array([0.0, 0.0, 0.5, 1.0, 1.0])
    on_a = np.array([0.0, 0.0, 0.0, 0.0, 1.0])
    given = {"a.p": a, "b.p": b, "c.p": 5e5}
    check_law(valve, given, {"a.q": on_a * lower, "b.q": (1.0 - on_a) * lower, "c.q": -lower}, rtol=1e-8)


@pytest.mark.thorough
def test_deceleration_valve() -> None:
    """Half-way along the cam half of the flow, at its end the leakage, and the spring's force on the roller."""
    valve = DecelerationValve(start=0.2, length=0.05, rate=4e3, leakage=0.01, transition_pressure=1e-2, **RATED)
    s, share, depth = [0.1, 0.225, 0.25, 0.26], [1.01, 0.51, 0.01, 0.01], [0.0, 0.025, 0.05, 0.06]
    for values in zip(s, share, depth, strict=True):
        expected = {"q": values[1] * K * 2e3, "rod.f": 4e3 * values[2]}
        check_law(valve, {"rod.s": values[0], "dp": 4e6}, expected, rtol=1e-8)
    with pytest.raises(ParameterError, match=r"^DecelerationValve\.sense must be 1 or -1"):
        DecelerationValve(start=0.2, length=0.05, sense=0.5, **RATED)


@pytest.mark.parametrize(("u", "bypass"), [(0.0, 1.0), (0.3, 0.5), (-0.3, 0.5), (0.6, 0.0), (-1.0, 0.0)])
def test_six_way_valve(u: float, bypass: float) -> None:
    """The bypass closes as the spool leaves the middle, whichever way; the other edges are those of a 4/3 valve."""
    valve = SixWayValve(bypass_flow=1e-3, closed=0.6, lap=0.1, lap_return=0.1, transition_pressure=1e-3, **RATED)
    opening = max((abs(u) - 0.1) / 0.9, 0.0)
    flows = {
        "q_cd": bypass * 2.0 * K * 1e3,
        "q_pa": opening * (u > 0.0) * K * 2e3,
        "q_pb": opening * (u < 0.0) * K * 2e3,
    }
    given = {"u.value": u, "p.p": 1e7, "t.p": 0.0, "a.p": 6e6, "b.p": 6e6, "c.p": 1e6, "d.p": 0.0}
    check_law(valve, given, flows | {"c.q": flows["q_cd"], "d.q": -flows["q_cd"]}, rtol=1e-8)


EDGE = MeteringEdge(width=0.03, stroke=1e-3, density=860.0, lap=1e-4, transition_pressure=1e-2)


@pytest.mark.thorough
def test_flow_force_on_a_spool() -> None:
    """0.43 width y dp for a sharp edge: 2 C_d C_v cos 69 degrees (Merritt, ch. 5). It closes, however the oil flows."""
    assert 2.0 * 0.61 * 0.98 * np.cos(np.deg2rad(69.0)) == pytest.approx(0.43, abs=2e-3)
    s, y = np.array([5e-5, 3e-4, 1.1e-3, 2e-3]), np.array([0.0, 2e-4, 1e-3, 1e-3])
    for position, opening in zip(s, y, strict=True):
        dp = np.array([7e6, -7e6])
        q = 0.61 * 0.03 * opening * np.sign(dp) * np.sqrt(2.0 * np.abs(dp) / 860.0)
        force = 2.0 * 0.61 * 0.98 * np.cos(1.2043) * 0.03 * opening * 7e6
        check_law(EDGE, {"rod.s": position, "dp": dp}, {"q": q, "rod.f": force}, rtol=1e-9)


@pytest.mark.thorough
def test_spool_with_four_edges() -> None:
    """The two open edges add their forces against the travel; with the same drops as a 4/3 valve, the same flows."""
    spool, s = FourWaySpool.of(EDGE), 5e-4
    p, t, a, b = 12e6, 0.0, 7e6, 4e6
    flow = 0.61 * 0.03 * 4e-4 * np.sqrt(2.0 / 860.0)
    force = 2.0 * 0.61 * 0.98 * np.cos(1.2043) * 0.03 * 4e-4 * (p - a + b - t)
    given = {"p.p": p, "t.p": t, "a.p": a, "b.p": b}
    for sense in (1.0, -1.0):
        ports = dict(given) if sense > 0.0 else dict(given, **{"a.p": b, "b.p": a})
        q = flow * np.sqrt([p - a, b - t])
        wanted = {"rod.f": sense * force, "p.q": q[0], "t.q": -q[1]}
        check_law(spool, {"rod.s": sense * s, **ports}, wanted, rtol=1e-9)


def _signal(signal: Part, block: Part) -> Connections:
    return (connect(signal.y, block.u),)


@pytest.mark.thorough
def test_proportional_valve_follows_its_second_order_lag() -> None:
    """1 - exp(-D w t)(cos + D/sqrt(1 - D^2) sin) of the rated flow."""
    valve = ProportionalValve(spool=SecondOrder(w=300.0, D=0.6), valve=FourWayValve(**RATED))
    rest = {"p.p": 1e7, "t.p": 0.0, "a.p": 6.5e6, "b.p": 3.5e6}
    check_law(valve, {"valve.u.value": 0.5, **rest}, {"valve.q_pa": 2.5e-4, "valve.q_bt": 2.5e-4}, rtol=1e-6)
    times = np.array([0.002, 0.005, 0.02])
    sol = simulate(Rig(parts=(Step(height=0.4), valve.spool), wiring=_signal), 0.05, save=jnp.asarray(times), rtol=1e-9)
    damped = 300.0 * np.sqrt(1.0 - 0.36)
    swing = np.cos(damped * times) + 0.75 * np.sin(damped * times)
    np.testing.assert_allclose(sol["parts[1].x"], 0.4 * (1.0 - np.exp(-180.0 * times) * swing), rtol=1e-6)


@pytest.mark.thorough
def test_pilot_stage_is_second_order_for_small_signals_and_of_limited_speed_for_large_ones() -> None:
    """A step of 1 per cent against the closed form; one of 1 moves with the rate between a start and an end."""
    stage, times = PilotStage(w=300.0, D=0.8, rate=50.0), np.array([0.003, 0.006, 0.012, 0.018])
    small, large = (
        simulate(Rig(parts=(Step(height=height), stage), wiring=_signal), 0.06, save=jnp.asarray(times), rtol=1e-9)
        for height in (0.01, 1.0)
    )
    damped = 300.0 * 0.6
    swing = np.cos(damped * times) + 0.8 / 0.6 * np.sin(damped * times)
    np.testing.assert_allclose(small["parts[1].x"], 0.01 * (1.0 - np.exp(-240.0 * times) * swing), rtol=1e-5)
    assert np.max(large["parts[1].z"]) < 1.0
    lag = 1.0 / (2.0 * 0.8 * 300.0)
    expected = 50.0 * (times - lag * (1.0 - np.exp(-times / lag)))  # the first stage fully open
    np.testing.assert_allclose(large["parts[1].x"][:3], expected[:3], rtol=1e-6)
    assert float(large.final.parts[1].x) == pytest.approx(1.0, abs=1e-4)


@pytest.mark.thorough
def test_hysteresis_of_a_servo_valve() -> None:
    """The way up and the way down are the width apart; small changes inside the loop do nothing."""
    times = jnp.array([0.1, 0.125, 0.375, 0.4, 0.6, 0.9])
    sol = simulate(Rig(parts=(Sine(amplitude=0.8, frequency=1.0), Play(width=0.1)), wiring=_signal), 1.0, save=times)
    u, y = np.asarray(sol["parts[0].y.value"]), np.asarray(sol["parts[1].x"])
    np.testing.assert_allclose((u - y)[:2], 0.05, atol=1e-3)
    np.testing.assert_allclose((u - y)[3:5], -0.05, atol=1e-3)
    assert (u - y)[5] == pytest.approx(0.05, abs=1e-3)
    valve = ServoValve(play=Play(width=0.02), stage=PilotStage(w=300.0, D=0.8, rate=50.0), valve=FourWayValve(**RATED))
    given = {
        "play.x": 0.5,
        "u.value": 0.505,
        "stage.x": 0.3,
        "p.p": 1e7,
        "t.p": 0.0,
        "a.p": 6.5e6,
        "b.p": 0.0,
    }
    check_law(valve, given, {"der(play.x)": 0.0, "valve.q_pa": 1.5e-4}, rtol=1e-6, atol=1e-9)
