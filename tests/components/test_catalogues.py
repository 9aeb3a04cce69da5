"""Data sheets: contents of the tables, errors on loading, components from order names, ratings exceeded in a run."""

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from _rig import Rig

from acausal import (
    ArgumentError,
    Array,
    Component,
    Connections,
    ParameterError,
    connect,
    quantity,
    repeat,
    replace,
    simulate,
    stack,
)
from acausal.testing import solved
from components import blocks, catalogues, electrical, rotational, thermal
from components.catalogues import COLUMNS, DataSheet, catalogue, load

MOTORS = catalogue("motors")


@pytest.mark.parametrize("name", COLUMNS)
def test_tables_of_the_library_load_and_say_where_they_come_from(name: str) -> None:
    sheets = catalogue(name)
    assert len(sheets) > 0
    assert all(sheet.source and sheet.date for sheet in sheets)


@pytest.mark.parametrize("sheet", [s for s in MOTORS if s.get("stall_current")], ids=lambda sheet: sheet.order)
def test_figures_of_motors_agree_with_each_other(sheet: DataSheet) -> None:
    """Stall, nominal point and no-load speed from R, k, I_0, within the rounding of two figures of three digits each.

    Without a load, brushes of graphite take a part of a volt more than the resistance does.
    """
    R, k, V = sheet["resistance"], sheet["torque_constant"], sheet["nominal_voltage"]
    idle = sheet["no_load_current"]
    np.testing.assert_allclose(sheet["stall_current"], V / R, rtol=7e-3)
    np.testing.assert_allclose(sheet["stall_torque"], k * sheet["stall_current"], rtol=5e-3)
    brushes = V - R * idle - k * sheet["no_load_speed"]
    assert -2e-3 * V < brushes < 0.6
    np.testing.assert_allclose(sheet["nominal_torque"], k * (sheet["nominal_current"] - idle), rtol=5e-3)


def test_stall_and_speed_of_the_re_50_follow_from_its_constants() -> None:
    sheet = MOTORS["370354"]
    np.testing.assert_allclose(sheet["stall_torque"], sheet["torque_constant"] * 24.0 / sheet["resistance"], rtol=1e-2)
    np.testing.assert_allclose(sheet["no_load_speed"], 24.0 / sheet["torque_constant"], rtol=1e-2)


def test_a_motor_from_its_order_name() -> None:
    """RE 40: R, L, k, J of the sheet; at no load it draws the stated current."""
    motor = catalogues.dc_motor("148867")
    assert motor.inductor is not None
    assert motor.bearing is not None
    figures = [motor.resistor.R, motor.inductor.L, motor.emf.k, motor.rotor.J]
    np.testing.assert_allclose(np.array(figures), [0.317, 82.3e-6, 30.2e-3, 138e-7], rtol=1e-12)
    np.testing.assert_allclose(
        motor.bearing.C * quantity(7580, "rpm").to("rad/s").magnitude, 30.2e-3 * 0.137, rtol=1e-9
    )
    warm = catalogues.brushed_motor("148867", magnets=-1e-3)
    np.testing.assert_allclose(warm.winding.C, 41.6 / 1.93, rtol=1e-12)
    np.testing.assert_allclose(warm.housing.C, 1120.0 / 4.65, rtol=1e-12)
    assert warm.emf.alpha == -1e-3
    with pytest.raises(ParameterError, match=r"motors.csv, FISE: winding_to_housing is not stated"):
        catalogues.brushed_motor("FISE")
    with pytest.raises(ArgumentError, match=r"motors.csv has no 'RE 41'\. It has 148867 \(RE 40\), "):
        catalogues.dc_motor("RE 41")


def test_a_gearhead_has_the_efficiency_of_its_sheet() -> None:
    """GP 52 C, 4.3:1, 91 %, with the ring held."""
    stage = catalogues.gearhead("GP 52 C 4.3:1")
    given = {"sun.phi": 0.0, "ring.phi": 0.0, "der(sun.phi)": 100.0, "der(ring.phi)": 0.0, "carrier.tau": -4.0}
    found = solved(stage, given | {"der(w_sun)": 0.0, "der(w_carrier)": 0.0})
    np.testing.assert_allclose(4.0 * found["w_carrier"] / (found["sun.tau"] * 100.0), 0.91, rtol=1e-9)


def test_the_re_50_warms_as_its_sheet_says() -> None:
    """Held at a current, its winding ends above ambient by the loss times both thermal resistances."""
    motor = catalogues.brushed_motor("370354")
    resistances = 1.0 / np.array([motor.inside.G, motor.outside.G])
    np.testing.assert_allclose(resistances, [1.24, 3.59], rtol=1e-12)
    np.testing.assert_allclose(motor.winding.C * resistances[0], 68.5, rtol=1e-12)
    np.testing.assert_allclose(motor.housing.C * resistances[1], 1510.0, rtol=1e-12)


@pytest.mark.parametrize("order", ["203115", "223081"])
def test_a_gear_train_has_ratio_and_efficiency_of_its_sheet(order: str) -> None:
    """With its number of stages, each of them loaded; the power that it is loaded with is far above the width."""
    sheet = catalogue("gearheads")[order]
    train = catalogues.gear_train(order)
    assert len(train.stages) == sheet["stages"]
    np.testing.assert_allclose(train.ratio, sheet["ratio"], rtol=1e-12)
    given = {"a.phi": 0.0, "der(a.phi)": 100.0, "b.tau": -4.0}
    speeds = {f"der(stages[{i}].{w})": 0.0 for i in range(len(train.stages)) for w in ("w_sun", "w_carrier")}
    found = solved(train, given | speeds)
    power = 4.0 * found[f"stages[{len(train.stages) - 1}].w_carrier"]
    np.testing.assert_allclose(power / (found["a.tau"] * 100.0), sheet["efficiency"], rtol=1e-9)


def test_search() -> None:
    found = MOTORS.search(stall_torque=(quantity(1.0, "N.m"), None), nominal_voltage=24.0)
    twelve = {sheet.order for sheet in MOTORS.search(stall_torque=(quantity(1.0, "N.m"), None), nominal_voltage=12.0)}
    assert {sheet.family for sheet in found} == {"RE 40", "RE 50", "RE 30", "DCX 32 L", "DCX 35 L"}
    assert twelve == {"DCX32L01GBKL448", "DCX35L01GBKL434"}
    assert [sheet.order for sheet in MOTORS.search(family="RE 25")] == ["118752"]
    assert len(MOTORS.search(maker="nobody")) == 0
    with pytest.raises(ArgumentError, match=r"motors.csv has no column 'torque'"):
        MOTORS.search(torque=1.0)


HEADS = "order,family,maker,displacement [cm3/rev],max_pressure [bar],source,date\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HEADS + "A,F,M,1.0,200,S,2012\nB,F,M,,200,S,2012\n", r"pumps.csv, row 3, column displacement: is missing\."),
        (HEADS + "A,F,M,1.0,200,S,\n", r"pumps.csv, row 2, column date: is missing\."),
        (
            HEADS + "A,F,M,1e9,200,S,2012\n",
            r"row 2, column displacement: must be within 1e-09 .. 0.001 m3/rad, got 1e9",
        ),
        (HEADS + "A,F,M,one,200,S,2012\n", r"row 2, column displacement: must be a number, got 'one'\."),
        (HEADS + "A,F,M,nan,200,S,2012\n", r"row 2, column displacement: must be within"),
        (HEADS.replace("cm3/rev", "bar"), r"column displacement: has the unit .bar., which is not convertible to m3"),
        (HEADS.replace("cm3/rev", "thing"), r"displacement: has the unit 'thing', which is not convertible to m3/rad"),
        (HEADS.replace(" [cm3/rev]", ""), r"column 'displacement': has no unit\. Write displacement \[m3/rad\]\."),
        (HEADS.replace("max_pressure", "pressure"), r"'pressure \[bar\]': is unknown\. Use one of order, family"),
        (HEADS.replace("displacement [cm3/rev],", ""), r"pumps.csv: has no column displacement\."),
        (HEADS + "A,F,M,1,200,S,2012\n" * 2, r"pumps.csv, column order: 'A' appears in 2 rows\."),
    ],
)
def test_tables_are_checked_on_loading(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "pumps.csv"
    path.write_text(text)
    with pytest.raises(ParameterError, match=message):
        load(path, COLUMNS["pumps"])


def test_a_table_of_one_s_own_makes_components(tmp_path: Path) -> None:
    path = tmp_path / "mine.csv"
    path.write_text(HEADS + "A,F,M,6.283185307179586,200,S,2012\n")
    pump = catalogues.pump(load(path, COLUMNS["pumps"])["A"], leakage=1e-12)
    np.testing.assert_allclose(np.array([pump.displacement, pump.leakage]), [1e-6, 1e-12], rtol=1e-12)


SERVOS = catalogue("servo_motors")


@pytest.mark.parametrize("sheet", SERVOS, ids=lambda sheet: sheet.order)
def test_figures_of_servo_motors_agree_with_each_other(sheet: DataSheet) -> None:
    """Flux from torque and from voltage; the speed at which the magnets induce the largest voltage of space vectors.

    The sheet rounds to two digits, and friction lowers the speed without a load. Torque over current falls towards the
    peak, since the machine saturates.
    """
    machine = catalogues.servo_motor(sheet).machine
    by_voltage = sheet["voltage_constant"] / np.sqrt(1.5) / machine.p
    np.testing.assert_allclose(machine.psi, by_voltage, rtol=1.5e-2)
    np.testing.assert_allclose(
        sheet["no_load_speed"], sheet["dc_voltage"] / np.sqrt(3.0) / (machine.p * machine.psi), rtol=3.5e-2
    )
    np.testing.assert_allclose(
        sheet["continuous_torque"],
        1.5 * machine.p * machine.psi * np.sqrt(2.0) * sheet["continuous_current"],
        rtol=4e-2,
    )
    saturated = sheet["peak_torque"] / (sheet["torque_constant"] * sheet["peak_current"])
    assert 0.85 < saturated < 1.0


def test_a_servo_motor_from_its_order_name() -> None:
    """Phase values from those between terminals, torque per rms current."""
    motor = catalogues.servo_motor("premo 2D 320 V", i_d=0.0)
    m = motor.machine
    np.testing.assert_allclose(np.array([m.Rs, m.Ld, m.Lq, motor.J, m.p]), [1.86, 3.715e-3, 3.715e-3, 8.3e-5, 4.0])
    np.testing.assert_allclose(m.torque(electrical.DqCurrents(0.0, np.sqrt(2.0))), 0.52, rtol=1e-12)


def test_a_servo_drive_has_the_smaller_ratings() -> None:
    """The inverter's continuous current is below the motor's, the motor's peak current is below the inverter's."""
    drive = catalogues.servo_drive("premo 2D 320 V", "SA52.0100 8 kHz", C=1e-3)
    assert drive.data_sheet is not None
    assert (drive.data_sheet["continuous_current"], drive.data_sheet["peak_current"]) == (4.04, 12.0)
    small = catalogues.servo_drive("premo 2D 320 V", "SA52.0075 8 kHz", C=1e-3).data_sheet
    assert small is not None
    assert (small["continuous_current"], small["peak_current"]) == (3.0, 9.0)
    np.testing.assert_allclose(drive.i_max, 12.0 * np.sqrt(2.0), rtol=1e-12)
    assert drive.data_sheet.order == "premo 2D 320 V with SA52.0100 8 kHz"
    bridge = catalogues.inverter("SA54.0150 16 kHz").data_sheet
    assert bridge is not None
    assert (bridge["rated_current"], bridge["peak_current"], bridge["peak_time"]) == (2.8, 8.4, 0.08)


class Servo(Component):
    """A servo drive turns a load with a torque."""

    supply: electrical.ConstantVoltage
    drive: electrical.PMSMDrive
    torque: blocks.Constant
    load: rotational.Inertia
    ground: electrical.Ground = electrical.Ground()

    def connections(self) -> Connections:
        return (
            connect(self.supply.p, self.drive.p),
            connect(self.supply.n, self.drive.n, self.ground.p),
            connect(self.torque.y, self.drive.u),
            connect(self.drive.shaft, self.load.a),
        )


def test_limits_of_a_servo_drive() -> None:
    """4 N.m need 4/0.52 A, above the continuous current of 4.04 A and below the peaks; the speed is not rated."""
    model = Servo(
        supply=electrical.ConstantVoltage(V=320.0),
        drive=catalogues.servo_drive("premo 2D 320 V", "SA52.0100 8 kHz", C=1e-3, v=320.0, wanted=4.0),
        torque=blocks.Constant(k=4.0),
        load=rotational.Inertia(J=1e-3),
    )
    found = catalogues.limits(simulate(model, 0.01, save="steps"))
    assert [one.rating for one in found] == ["continuous_current"]
    np.testing.assert_allclose([found[0].limit, found[0].largest, found[0].share], [4.04, 4.0 / 0.52, 1.0], rtol=1e-6)
    names = [rating for _, _, rating in found.checked]
    assert names == ["continuous_current", "peak_current", "peak_torque"]


def run_up(supply: Any, motor: Any, gear: Any, ring: Any, load: Any, room: Any, ground: Any) -> Connections:
    return (
        connect(supply.p, motor.p),
        connect(supply.n, motor.n, ground.p),
        connect(motor.shaft, gear.sun),
        connect(ring.flange, gear.ring),
        connect(gear.carrier, load.a),
        connect(motor.ambient, room.port),
    )


def test_limits_of_a_run() -> None:
    """Stalled by a heavy load at 24 V: the current is far above its continuous rating, the gearhead's torque too, and

    the winding passes 155 C after a while; the speed stays below its rating.
    """
    parts = (
        electrical.ConstantVoltage(V=24.0),
        catalogues.brushed_motor("148867"),
        catalogues.gearhead("203115"),
        rotational.Fixed(),
        rotational.Inertia(J=100.0),
        thermal.FixedTemperature(temperature=298.15),
        electrical.Ground(),
    )
    solution = simulate(Rig(parts=parts, wiring=run_up), 8.0, save="steps")
    found = {(one.path, one.rating): one for one in catalogues.limits(solution)}
    assert set(found) == {
        ("parts[1]", "nominal_current"),
        ("parts[1]", "max_winding_temperature"),
        ("parts[2]", "continuous_torque"),
        ("parts[2]", "intermittent_torque"),
    }
    current = found["parts[1]", "nominal_current"]
    np.testing.assert_allclose([current.limit, current.largest], [5.77, 24.0 / 0.317], rtol=0.02)
    hot = found["parts[1]", "max_winding_temperature"]
    temperatures = np.asarray(solution.parts[1].winding.T)
    np.testing.assert_allclose(hot.largest, np.max(temperatures), rtol=1e-12)
    np.testing.assert_allclose(hot.first, np.asarray(solution.ts)[temperatures > 428.15][0], rtol=1e-12)
    assert "parts[1] (148867): max_winding_temperature" in str(catalogues.limits(solution))
    # The temperature rises, so that the share is the time left after it crosses its limit.
    crossed = np.interp(428.15, temperatures, np.asarray(solution.ts))
    np.testing.assert_allclose(hot.share, 1.0 - crossed / solution.t1, rtol=1e-9)


class Side(Component):
    """Motors side by side on one supply."""

    motors: Array[electrical.DCMotor]
    supply: electrical.ConstantVoltage
    ground: electrical.Ground = electrical.Ground()

    def connections(self) -> Connections:
        ends = (self.motors[:].n, self.supply.n, self.ground.p)
        return connect(self.supply.p, self.motors[:].p), connect(*ends)


@pytest.mark.thorough
def test_what_was_checked_is_said() -> None:
    """Nothing for a model without data sheets; each motor of an array."""
    model = Side(
        motors=stack([catalogues.dc_motor("148867", R=20.0), catalogues.dc_motor("148867")]),
        supply=electrical.ConstantVoltage(V=12.0),
    )
    found = catalogues.limits(simulate(model, 0.1, save="steps"))
    assert found.checked == (("motors[0]", "148867", "nominal_current"), ("motors[1]", "148867", "nominal_current"))
    assert [one.path for one in found] == ["motors[1]"]
    idle = catalogues.limits(simulate(replace(model, {"supply.V": 0.5}), 0.1, save="end"))
    assert str(idle).splitlines() == [
        "None of the ratings checked is exceeded:",
        "motors[0] (148867): nominal_current",
        "motors[1] (148867): nominal_current",
    ]
    copy = pickle.loads(pickle.dumps(idle))
    assert (copy, copy.checked) == (idle, idle.checked)
    plain = Side(motors=repeat(electrical.DCMotor(R=0.3, k=0.03, J=1e-5), 2), supply=model.supply)
    assert str(catalogues.limits(simulate(plain, 0.1, save="end"))) == (
        "No rating was checked: no part of the model has a data sheet that states one."
    )
