"""The clutch held open: energies, decay, events and derivatives."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from acausal import replace
from studies.actuators import (
    COIL,
    SUPPLY,
    closing,
    ehs_maxon,
    ema_fise,
    hold,
    motor_held,
    spring_rate,
    valve_held,
)
from studies.actuators._holding import STROKE
from studies.hold import DURATION, KEYWORDS, evaluate, run, static_power

pytestmark = pytest.mark.slow

Tables = dict[str, list[dict[str, Any]]]
BAND = 0.5e-3


@pytest.fixture(scope="module")
def by_motor() -> Any:
    return run(motor_held())


@pytest.fixture(scope="module")
def by_valve() -> Any:
    return run(valve_held())


def switched(solution: Any) -> tuple[np.ndarray, np.ndarray]:
    """Times at which the motor is switched off, and on again."""
    events = solution.events
    off, on = (np.asarray(events.of_event(f"controller.{name}")) for name in ("off", "on"))
    return off[np.isfinite(off)], on[np.isfinite(on)]


def test_energy_balance(by_motor: Any, by_valve: Any) -> None:
    for solution in (by_motor, by_valve):
        supplied = sum(solution.energy.supplied.values())
        assert abs(solution.energy.imbalance) < 1e-10 * supplied


def test_power_of_the_motor_at_rest(by_motor: Any) -> None:
    end, model = by_motor.final, motor_held()
    assert model.motor.bearing is not None
    area = 0.25 * math.pi * float(model.slave.bore) ** 2
    pressure = float(spring_rate(model)) * STROKE / area
    w = pressure / float(model.leak.resistance * model.pump.displacement)
    i = (float(model.pump.displacement) * pressure + float(model.motor.bearing.C) * w) / float(model.motor.emf.k)
    assert float(end.supply.u.value) == pytest.approx(
        float(model.motor.resistor.R) * i + float(model.motor.emf.k) * w, 1e-9
    )
    assert float(end.motor.p.v * end.motor.p.i) == pytest.approx(float(static_power(model)), rel=1e-9)


def test_leaking_past_the_shut_valve(by_valve: Any) -> None:
    """Spring and liquid discharge through the leak: with p = c s / A, tau = R_leak (A^2 / c + 1 / K), without losses.

    The exact rate, an eigenvalue, includes the losses of the line and of the piston seal.
    """
    model = valve_held()
    area = 0.25 * math.pi * float(model.slave.bore) ** 2
    spring = float(spring_rate(model)) / area**2  # Pa/m3
    leak, stiffness, damping = (float(x) for x in (model.leak.resistance, model.line.stiffness, model.line.damping))
    viscous = float(model.seal.C) / area**2
    # With volumes x of the cylinder and V of the line: spring x + viscous x' = K V + B V' = p, x' + V' = -p / R.
    matrix = np.linalg.solve([[viscous, -damping], [leak + viscous, leak]], [[-spring, stiffness], [-spring, 0.0]])
    slow = max(np.linalg.eigvals(matrix).real)
    assert slow == pytest.approx(-1.0 / (leak * (1.0 / spring + 1.0 / stiffness)), rel=1e-4)
    ts, s = np.asarray(by_valve.ts), np.asarray(by_valve.slave.rod.s)
    off, on = switched(by_valve)
    for begin, end in zip(off, on, strict=False):
        quiet = np.flatnonzero((ts > begin + 0.2) & (ts < end))
        first = quiet[0]
        np.testing.assert_allclose(s[quiet], s[first] * np.exp(slow * (ts[quiet] - ts[first])), rtol=1e-8)


def test_switching(by_valve: Any) -> None:
    off, on = switched(by_valve)
    assert (len(off), len(on)) == (10, 9)
    # The relay switches each time, and at the start.
    assert len(by_valve.events) == 2 * (len(off) + len(on)) + 1
    assert np.min(by_valve.events.of_event("relay.rise")) == 0.0
    np.testing.assert_allclose(np.diff(on), np.diff(on)[0], rtol=1e-7)
    closed = np.sum(np.append(on, DURATION) - off)
    coil = float(by_valve.integrals["coil"][-1])
    assert coil == pytest.approx(SUPPLY**2 / (COIL + 1e-5) * closed + SUPPLY**2 * 1e-5 * (DURATION - closed), 1e-9)


def test_rows(held: Tables) -> None:
    static, motor, valve, *_ = held["rows"]
    assert static["energy"] == pytest.approx(DURATION * static["mean_power"])
    assert motor["energy"] == pytest.approx(static["energy"], rel=5e-3)
    assert motor["energy_coil"] == 0.0
    assert motor["energy"] == pytest.approx(8836.4514, rel=1e-6)
    assert valve["energy"] == pytest.approx(1558.11632, rel=1e-6)
    assert valve["energy"] == pytest.approx(valve["energy_motor"] + valve["energy_coil"])
    assert valve["top_ups"] == 9
    assert STROKE - BAND < valve["lowest"] < STROKE < valve["highest"] < STROKE + BAND


def test_fise_held_by_motor_or_brake(held: Tables) -> None:
    """The motor takes R i^2 of the holding current; a brake needs none of it."""
    motor, brake = held["rows"][3:]
    base = ema_fise()
    assert motor["motor_current"] == pytest.approx(float(hold(base).current), rel=1e-12)
    assert motor["mean_power"] == pytest.approx(float(base.motor.resistor.R) * motor["motor_current"] ** 2, rel=1e-12)
    assert (brake["motor_current"], brake["mean_power"]) == (0.0, 10.0)
    assert motor["energy"] == pytest.approx(DURATION * motor["mean_power"], rel=1e-12)


def test_coil_or_battery_lost(held: Tables) -> None:
    """The open valve hardly delays the clutch; an active controller keeps it open."""
    switched_off, lost, goes_on = held["failures"]
    base = ehs_maxon()
    for found, model in ((switched_off, base), (lost, replace(base, {"motor.resistor.R": 1e6}))):
        alone = float(closing(model, save="end").t1)
        assert found["closed"] == pytest.approx(alone, rel=2e-3)
        assert found["power"] < 1e-3
    assert goes_on["closed"] is None
    assert STROKE - BAND < goes_on["lowest"] < STROKE
    assert goes_on["power"] > held["rows"][0]["mean_power"]


def test_sweep(held: Tables) -> None:
    rows = [row for row in held["sweep"] if row["actuator"] == "valve_held"]
    assert [row["top_ups"] for row in rows] == sorted((row["top_ups"] for row in rows), reverse=True)
    assert rows[0]["top_ups"] > 40
    assert rows[-1]["top_ups"] == 0
    for actuator in KEYWORDS:
        energies = [row["energy"] for row in held["sweep"] if row["actuator"] == actuator]
        assert np.all(np.diff(energies) < 0.0)


def test_pictures(held: Tables, folder: Path) -> None:
    for name in ("hold", "hold_energy"):
        assert (folder / "pictures" / f"{name}.png").stat().st_size > 10_000
    assert (folder / "pictures" / "hold.html").read_text().count("data:image/png") == 2


@pytest.mark.parametrize("actuator", list(KEYWORDS))
def test_elasticities_are_those_of_differences(actuator: str) -> None:
    """Fourth-order differences, with steps so small that the number of top-ups does not change."""
    names, h, rtol = list(KEYWORDS[actuator]), 1e-4, 1e-11
    found, slopes = evaluate(actuator, [{}] * len(names), names, rtol)
    for name in ("displacement", "coil_resistance" if actuator == "valve_held" else "resistance"):
        changes = [{name: KEYWORDS[actuator][name] * (1.0 + k * h)} for k in (-2, -1, 1, 2)]
        changes += [{}] * (len(names) - len(changes))  # the number for which the program is compiled
        near, _ = evaluate(actuator, changes, names, rtol)
        assert np.all(near.top_ups == found.top_ups)
        for y, slope in [(near.energy, slopes.energy)] + [(near.period, slopes.period)] * (actuator == "valve_held"):
            difference = (8.0 * (y[2] - y[1]) - (y[3] - y[0])) / (12.0 * h)
            assert float(slope[names.index(name)]) == pytest.approx(float(difference), rel=1e-5, abs=1e-6 * float(y[0]))
