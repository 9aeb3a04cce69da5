"""Users' actuators: parts, conditions, stops, and errors."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from acausal import ArgumentError, ParameterError, parameters, quantity, replace, simulate
from components.catalogues import catalogue
from components.electrical import DCMotor
from components.rotational import PlanetaryGearbox, PlanetaryTrain
from components.translational import ClutchSpring, TabulatedSpring
from studies.__main__ import main
from studies._own import task
from studies.actuators import (
    STROKE,
    at_rest,
    at_temperature,
    cam_curves,
    closing,
    compare,
    electrohydraulic,
    electromechanical,
    energy,
    hold,
    line_pressure,
    opening_time,
    optimum,
    winding,
    worn,
)
from studies.actuators._own import LEADS

MOTOR = DCMotor(R=0.3, k=0.03, J=2e-5, friction=1e-3)
HEADS = "order,family,maker,nominal_voltage [V],resistance [ohm],torque_constant [mN.m/A],inertia [g.cm2],source,date\n"


def test_parts_are_order_names_sheets_components_or_numbers() -> None:
    sheet = catalogue("motors")["148867"]
    by_name, by_sheet = (electromechanical(one, 4.0).motor for one in ("148867", sheet))
    assert by_name.data_sheet == by_sheet.data_sheet == sheet
    assert float(by_name.resistor.R) == pytest.approx(sheet["resistance"] + LEADS, rel=1e-12)
    assert float(electromechanical(MOTOR, 4.0).motor.resistor.R) == 0.3
    one, two = (electromechanical(MOTOR, order).gearbox for order in ("223081", "203115"))
    assert isinstance(one, PlanetaryGearbox)
    assert isinstance(two, PlanetaryTrain)
    assert float(two.ratio) == pytest.approx(12.25, rel=1e-12)
    pump = electrohydraulic(MOTOR, quantity(1.25, "cm3/rev")).pump
    np.testing.assert_allclose(pump.displacement, catalogue("pumps")["0.5 D 1.60"]["displacement"], rtol=1e-12)


@pytest.mark.parametrize("stroke", [0.3 * STROKE, STROKE])
def test_a_clutch_of_samples_is_held_as_the_spring_on_which_they_lie(stroke: float) -> None:
    spring = ClutchSpring(rate=58e3, preload=20.0)
    positions = np.linspace(0.0, 15e-3, 6)
    sampled = TabulatedSpring(positions=positions, forces=20.0 + 58e3 * positions)
    held = [hold(electrohydraulic(MOTOR, 2e-7, clutch=one), stroke) for one in (spring, sampled)]
    np.testing.assert_allclose(held[0].pressure * electrohydraulic(MOTOR, 2e-7).slave.area, 20.0 + 58e3 * stroke)
    np.testing.assert_allclose(held[0].current, held[1].current, rtol=1e-9)


def test_temperature_changes_winding_magnets_and_liquid_and_comes_back() -> None:
    model = electrohydraulic(MOTOR, 2e-7)
    cold = at_temperature(model, -30.0)
    assert float(cold.motor.resistor.R / model.motor.resistor.R) == pytest.approx(winding(243.15), rel=1e-9)
    assert float(cold.motor.emf.k) > float(model.motor.emf.k)
    assert cold.pipe is not None
    assert model.pipe is not None
    thicker = float(cold.pipe.resistance / model.pipe.resistance)
    assert thicker > 10.0
    assert float(cold.pump.leakage / model.pump.leakage) == pytest.approx(1.0 / thicker, rel=1e-9)
    back = parameters(at_temperature(cold, 25.0, reference=-30.0))
    for path, value in parameters(model).items():
        np.testing.assert_allclose(back[path], value, rtol=1e-12, err_msg=path)


def test_wear_loads_the_clutch_and_opens_leaks() -> None:
    model: Any = electrohydraulic(MOTOR, 2e-7)
    old = worn(model, load=700.0, leaks=4.0)
    assert float(line_pressure(old) * old.slave.area) == pytest.approx(700.0, rel=1e-9)
    assert float(old.pump.leakage / model.pump.leakage) == pytest.approx(4.0, rel=1e-12)


@pytest.mark.thorough
def test_an_electrohydraulic_actuator_left_on_ends_at_its_stop_and_its_relief_valve() -> None:
    """Without stops and relief valve, it continues until its motor stalls: k V/(R D) = 68 bar."""
    model = electrohydraulic(MOTOR, 2e-7, slip=0.0)
    left_on = simulate(model, 1.0, save="end", rtol=1e-6, max_events=200).final
    assert 15e-3 < float(left_on.slave.rod.s) < 15.1e-3
    assert 40e5 < float(left_on.line.p) < 43e5
    free = simulate(electrohydraulic(MOTOR, 2e-7, slip=0.0, relief=None, stops=False), 1.0, save="end").final
    stall = 13.5 / 0.3 * 0.03 / 2e-7
    assert float(free.line.p) == pytest.approx(stall, rel=1e-3)


@pytest.mark.parametrize("arguments", [{}, {"motor": "nobody"}], ids=["no motor", "unknown motor"])
def test_a_motor_is_needed(arguments: dict[str, Any]) -> None:
    with pytest.raises(ArgumentError, match=r"A motor is required|motors.csv has no 'nobody'"):
        task(**arguments)


def test_a_file_tells_parts_and_what_is_asked(tmp_path: Path) -> None:
    (tmp_path / "mine.csv").write_text(HEADS + "M,F,X,12,0.3,30,200,own,2026\nN,F,X,12,0.2,20,200,own,2026\n")
    file = tmp_path / "own.toml"
    file.write_text(
        'concept = "electrohydraulic"\nmotor = "mine.csv:N"\npump = "0.5 D 1.60"\nvoltage = "12 V"\nstops = false\n'
        'minimise = "holding current"\n[limits]\n"opening time" = "<= 100 ms"\n[set]\n"slave.bore" = "18 mm"\n'
        '[free]\n"slave.bore" = ["14 mm", "22 mm"]\n'
    )
    found = task(file, changes=["supply.V=11", "clutch.rate=60 N/mm"], temperatures=[-30.0])
    values = {path: float(value) for path, value in parameters(found.model).items() if np.ndim(value) == 0}
    assert values["supply.V"] == 11.0
    assert values["clutch.rate"] == pytest.approx(60e3)
    assert values["slave.bore"] == pytest.approx(18e-3)
    assert values["motor.resistor.R"] == pytest.approx(0.2 + LEADS)
    assert found.asked["temperatures"] == [-30.0]
    assert found.asked["minimise"] == "holding current"
    assert found.asked["free"] == {"slave.bore": ("14 mm", "22 mm")}
    with pytest.raises(ArgumentError, match=r"has 2 rows: choose one, as in .*mine.csv:ORDER. The rows are M, N"):
        task(file, motor=str(tmp_path / "mine.csv"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("concept = ", r"is not a valid TOML file"),
        ('concept = "magic"', r"concept must be electromechanical or electrohydraulic, got 'magic'"),
        ('concept = "electrohydraulic"\nmotor = "FISE"', r"electrohydraulic cannot be built: .*'pump'"),
        ('concept = "electrohydraulic"\nmotor = "mine.csv"\npump = 1e-7', r"mine.csv does not exist"),
        ('concept = "electrohydraulic"\nmotor = "FISE"\npump = "0.5 D 1.60"\nvoltage = "much"', r"got 'much'"),
    ],
)
def test_what_a_file_says_wrong(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "own.toml"
    file.write_text(text)
    with pytest.raises(ArgumentError, match=message):
        task(file)


def test_changes_on_the_command_line_are_checked() -> None:
    with pytest.raises(ArgumentError, match=r"--set takes PATH=VALUE"):
        task(motor="FISE", changes=["supply.V"])
    with pytest.raises(ParameterError, match=r"supply.V"):
        task(motor="FISE", changes=["supply.V=12 A"])


def test_an_optimum_is_asked_for_by_names() -> None:
    with pytest.raises(ArgumentError, match=r"optimum has no result 'mass'. The results are opening time, "):
        optimum(electromechanical(MOTOR, 4.0), limits={"mass": "<= 2 kg"})
    with pytest.raises(ArgumentError, match=r"use a single ratio as the gearhead"):
        optimum(electromechanical(MOTOR, "203115"))


def test_the_work_of_a_cam_is_stored_in_clutch_and_line() -> None:
    """The integral of the torque over the angle, by the trapezoidal rule with 4000 points."""
    model: Any = electromechanical(MOTOR, 4.0)
    curves = cam_curves(model, points=4001)
    work = np.trapezoid(curves.torque, curves.angle)
    held = hold(model)
    stored = 0.5 * 58e3 * STROKE**2 + 0.5 * float(held.pressure * held.compression)
    assert work == pytest.approx(stored, rel=1e-5)
    slope = np.gradient(np.asarray(curves.lift), np.asarray(curves.angle))[1:-1]
    # The contact force acts along the line through the centres of disc and roller.
    reach = np.asarray(curves.lift)[1:-1] + float(model.cam.profile.radius - model.cam.profile.eccentricity)
    np.testing.assert_allclose(np.tan(curves.pressure_angle)[1:-1], slope / reach, rtol=1e-3)
    with pytest.raises(ArgumentError, match=r"takes an actuator with an eccentric disc, not Electrohydraulic"):
        cam_curves(electrohydraulic(MOTOR, 2e-7))


@pytest.mark.thorough
def test_energies_of_an_opening() -> None:
    """The clutch stores 1/2 k s^2, and the hold takes R i^2 for its duration."""
    model = electrohydraulic(MOTOR, 2e-7, stops=False)
    spent = energy(model, hold_time=20.0, rtol=1e-8)
    assert float(spent.clutch) == pytest.approx(0.5 * 58e3 * STROKE**2, rel=1e-6)
    assert float(spent.holding) == pytest.approx(20.0 * 0.3 * float(hold(model).current) ** 2, rel=1e-9)
    assert 0.0 < float(spent.winding) < float(spent.battery)
    assert 0.0 < float(spent.efficiency) < 1.0


@pytest.mark.thorough
def test_a_held_actuator_without_friction_stays() -> None:
    """It starts from its static equilibrium, with its holding current."""
    model = replace(electromechanical(MOTOR, 4.0, stops=False, pipe=None), {"gearbox.loss.efficiency": 1.0})
    held = hold(model)
    start = replace(at_rest(model, held), {"supply.V": model.motor.resistor.R * held.current})
    end = simulate(start, 0.02, save="end", rtol=1e-9).final
    assert float(end.slave.rod.s) == pytest.approx(STROKE, rel=1e-6)


@pytest.mark.thorough
def test_the_command_line_says_what_it_lacks(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["optimise", "--temperature", "-30"])
    assert "A motor is required" in capsys.readouterr().err


@pytest.mark.slow
def test_the_ratio_that_the_command_line_finds_is_the_fastest(tmp_path: Path) -> None:
    """Cold, at 12 V: a ratio one per cent larger or smaller takes longer."""
    motor = tmp_path / "mine.csv"
    motor.write_text(HEADS + "M,F,X,12,0.12,18,150,own,2026\n")
    said = ["--motor", str(motor), "--set", "supply.V=12", "--temperature", "-30"]
    rows = tmp_path / "rows.json"
    main(["optimise", *said, "--json", str(rows)])
    table = json.loads(rows.read_text())
    (best,) = table["rows"]
    (time,) = table["results"]
    model = at_temperature(task(motor=str(motor), changes=["supply.V=12"]).model, -30.0)
    around = [
        float(opening_time(replace(model, {"gearbox.ratio": factor * best["value"]}), rtol=1e-8))
        for factor in (0.99, 1.0, 1.01)
    ]
    assert around[1] == pytest.approx(time["value"], rel=1e-6)
    assert around[1] < min(around[0], around[2])


@pytest.mark.slow
def test_concepts_side_by_side() -> None:
    """Masses of the data sheets plus the rest, the hold of `hold`, and the energies of `energy`."""
    model = electrohydraulic("148867", "0.5 D 1.60", friction=4e-3)
    table = compare({"mine": model}, rest={"mine": 0.42}, costs={"mine": 500.0})
    found = table["mine"]
    assert found.mass == pytest.approx(0.48 + 0.9 + 0.42)
    assert found.opening_time == pytest.approx(float(opening_time(model, rtol=1e-8)), rel=1e-6)
    assert found.holding_power == pytest.approx(float(hold(model).power))
    assert found.battery_current * 13.5 == pytest.approx(found.holding_power)
    assert float(found.energies.clutch) == pytest.approx(0.5 * 58e3 * STROKE**2, rel=1e-5)
    head, line = str(table).splitlines()
    assert head.split()[0] == "actuator"
    assert len(head) == len(line)
    assert line.split()[0] == "mine"
    assert line.split()[-2:] == ["1.8", "500"]


@pytest.mark.slow
def test_an_optimum_keeps_its_limits_at_all_temperatures() -> None:
    """The smallest holding current is that of the smallest pump that opens in time at the cold temperature."""
    model = electrohydraulic("370354", "0.5 D 1.60", voltage=12.0, friction=4e-3, pipe=(6e-3, 1.0))
    free = {"pump.displacement": ("0.5 cm3/rev", "4 cm3/rev")}
    design = optimum(
        model, free, minimise="holding current", limits={"opening time": "<= 100 ms"}, temperatures=(-30.0, 100.0),
        sensitivities=False, rtol=1e-8,
    )  # fmt: skip
    assert design.kkt_residual < 1e-6
    times = [float(opening_time(at_temperature(design.model, celsius), rtol=1e-8)) for celsius in (-30.0, 100.0)]
    assert max(times) <= 0.1 * (1.0 + 1e-6)
    smaller = replace(design.model, {"pump.displacement": 0.98 * design.model.pump.displacement})
    late = [float(opening_time(at_temperature(smaller, celsius), rtol=1e-8)) for celsius in (-30.0, 100.0)]
    assert max(late) > 0.1 or float(design.model.pump.displacement) == pytest.approx(0.5e-6 / (2.0 * np.pi))


@pytest.mark.slow
def test_a_clutch_closes_without_its_battery() -> None:
    """With a short circuit, which brakes the motor, it takes longer than with an open circuit."""
    model = electrohydraulic("148867", "0.5 D 1.60", friction=4e-3)
    braked, free = (closing(one, save="end", rtol=1e-8) for one in (model, replace(model, {"motor.resistor.R": 1e6})))
    assert float(braked.final.slave.rod.s) == pytest.approx(0.05 * STROKE, rel=1e-5)
    assert float(free.t1) < float(braked.t1) < 1.0
