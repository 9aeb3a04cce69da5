"""The comparison of architectures: the rows of the documentation against closed forms and against runs."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import diffrax
import jax
import numpy as np
import pytest
import scipy.optimize
from _thesis_reference import OPENING_TIMES
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from acausal import Result, parameters, replace, simulate
from components.electrical import ConstantVoltage
from components.rotational import Helix
from studies.actuators import DISPLACEMENT, SUPPLY, at_temperature, worn
from studies.architectures import (
    ARCHITECTURES,
    Architecture,
    Row,
    as_text,
    limits_as_text,
    open_clutch,
    stored,
    study,
)
from studies.architectures._parts import HIGHEST, pump_data, re40, relief
from studies.architectures._plot import kind_of, plot_areas, plot_energies, plot_figures
from studies.architectures._rows import gradients_of, opening_time_of, sizes_of
from studies.architectures._stored import charged
from studies.architectures._words import LOSSES, SIZES, limits

ROWS = {row.architecture: row for row in stored()}
STROKE = 12e-3


def named(name: str) -> Architecture:
    return next(item for item in ARCHITECTURES if item.name == name)


def test_every_architecture_has_a_row() -> None:
    assert list(ROWS) == [item.name for item in ARCHITECTURES]


@pytest.mark.parametrize("name", list(ROWS))
def test_account(name: str) -> None:
    row = ROWS[name]
    assert row.imbalance < 1e-6
    assert row.energy + row.compression == pytest.approx(sum(row.losses.values()) + row.stored, rel=1e-7)
    assert row.energy == pytest.approx(sum(row.energies.values()), rel=1e-12)
    assert all(lost > -1e-6 * row.energy for lost in row.losses.values())
    assert row.energies["holding"] == pytest.approx(10.0 * row.holding_power, rel=1e-12)


@pytest.mark.parametrize("name", list(ROWS))
def test_battery_and_motor(name: str) -> None:
    """The battery supplies the holding power at its voltage; the motor current can differ from the battery current."""
    row = ROWS[name]
    assert row.battery_current == pytest.approx(row.holding_power / SUPPLY, rel=1e-12)
    if isinstance(named(name).build().supply, ConstantVoltage):
        assert row.motor_current == pytest.approx(row.battery_current, rel=0.02)


def test_drives_that_lock_themselves_hold_without_current() -> None:
    """The controller of the worm takes some power until it is at rest."""
    for name in ("worm", "screw"):
        assert abs(ROWS[name].motor_current) < 1e-3
        assert abs(ROWS[name].holding_power) < 1.0


def test_ball_screw_is_held_by_its_motor() -> None:
    """The current equals that of the load, F lead/(2 pi N k), up to the friction."""
    row, model = ROWS["ball screw"], named("ball screw").build()
    helix = Helix.of_screw(diameter=20e-3, lead=20e-3, mu=0.01)
    force = row.flows["holding"]["source_p"] * float(model.master.area)
    load = force * 20e-3 / (2.0 * np.pi * float(model.gearbox.ratio * model.motor.emf.k))
    assert float(helix.driven) * load <= row.motor_current <= load / float(helix.driving) * (1.0 + 1e-9)
    assert row.losses["screw.gear"] < 0.05 * row.losses["motor.bearing"]


@pytest.mark.parametrize("name", list(ROWS))
def test_compressed_liquid(name: str) -> None:
    """Only cylinders with their own liquid carry its energy p^2/(2 K), at most once in each direction."""
    row, model = ROWS[name], named(name).build()
    if not hasattr(model, "accumulator") or not hasattr(model.slave, "liquid"):
        assert abs(row.compression) < 1e-9 * row.energy
        return
    area = 0.25 * np.pi * (float(model.slave.bore) ** 2 - float(model.slave.rod) ** 2)
    highest = float(model.relief_a.cracking_pressure) + float(model.slave.p_a)
    density = highest**2 / (2.0 * float(model.slave.liquid.bulk_modulus))
    assert 0.0 < abs(row.compression) < density * area * STROKE


@pytest.mark.parametrize("name", list(ROWS))
def test_duty_is_done(name: str) -> None:
    row = ROWS[name]
    assert STROKE - 1e-3 < row.lowest <= row.highest < STROKE + 1e-3
    assert abs(row.closed) < 0.5e-3
    for figures in row.conditions.values():
        assert abs(figures["closed"]) < 1e-3


@pytest.mark.parametrize("name", list(ROWS))
def test_gradients(name: str) -> None:
    """All main sizes have a gradient, equal in both modes; more winding resistance never helps."""
    row = ROWS[name]
    assert set(row.gradients) == set(named(name).sizes)
    assert row.modes < 1e-12
    assert row.gradients.get("motor.resistor.R", 0.0) >= 0.0


@pytest.mark.parametrize("name", list(ROWS))
def test_start_values_of_other_sizes(name: str) -> None:
    """The start of a model has its type and, for the original sizes, its start values."""
    model = named(name).build()
    started = named(name).start(model)
    assert type(started) is type(model)
    assert jax.tree.all(jax.tree.map(np.array_equal, started, model))


def losses_of_the_pump(p: float) -> tuple[float, float]:
    """Slip in m3/s and torque in N.m of the pump at the pressure p."""
    losses, viscosity = pump_data()["losses"], 1050.0 * 8e-6
    return float(losses.C_s) * DISPLACEMENT * p / viscosity, (1.0 + float(losses.C_f)) * DISPLACEMENT * p


def at_rest(p: float) -> tuple[float, float]:
    """Steady current and flow of motor and pump against the pressure p."""
    motor = re40()
    assert motor.bearing is not None
    r, k, c = (float(x) for x in (motor.resistor.R, motor.emf.k, motor.bearing.C))
    slip, torque = losses_of_the_pump(p)
    w = (SUPPLY - r * torque / k) / (k + r * c / k)
    return (torque + c * w) / k, DISPLACEMENT * w - slip


def test_fixed_pump_at_constant_pressure() -> None:
    """Motor and pump against the relief valve, solved by bracketing."""
    valve, row = relief(), ROWS["constant pressure"]

    def surplus(p: float) -> float:
        width = float(valve.transition_pressure)
        opening = width * np.logaddexp((p - float(valve.cracking_pressure)) / width, 0.0)
        return at_rest(p)[1] - float(valve.conductance) * opening

    p = scipy.optimize.root_scalar(surplus, bracket=(HIGHEST, 1.2 * HIGHEST), xtol=1.0).root
    assert row.flows["holding"]["source_p"] == pytest.approx(p, rel=1e-6)
    assert row.motor_current == pytest.approx(at_rest(p)[0], rel=1e-6)


def test_bleed_off() -> None:
    """Motor and pump against the pressure of the held clutch."""
    row, model = ROWS["bleed-off"], named("bleed-off").build()
    p = float(model.clutch.rate) * STROKE / (0.25 * np.pi * float(model.slave.bore) ** 2)
    assert row.flows["holding"]["source_p"] == pytest.approx(p, rel=1e-6)
    assert row.flows["holding"]["source_q"] == pytest.approx(at_rest(p)[1], rel=1e-6)
    assert row.motor_current == pytest.approx(at_rest(p)[0], rel=1e-6)


def idle(p: float, leak: float = 0.0) -> float:
    """Current of a motor with a variable pump that holds the pressure p and delivers only a leakage in m3/s.

    It overcomes the friction of the bearing, and that of the pump under pressure.
    """
    motor = re40()
    assert motor.bearing is not None
    r, k, c = (float(x) for x in (motor.resistor.R, motor.emf.k, motor.bearing.C))
    slip, _ = losses_of_the_pump(p)
    drag = float(pump_data()["losses"].C_f) * DISPLACEMENT * p

    def missing(w: float) -> float:
        return SUPPLY - r * (drag + (slip + leak) / w * p + c * w) / k - k * w

    w = scipy.optimize.root_scalar(missing, bracket=(100.0, 1000.0), xtol=1e-10).root
    return (SUPPLY - k * w) / r


def test_variable_pump_idles() -> None:
    """The pump compensates for its slip and for the leakage of the relief valve; the mean over the hold is larger.

    The swash plate takes five time constants to swing back to a hundredth of its angle, and until then the motor can
    stall.
    """
    row, model = ROWS["pressure compensated"], named("pressure compensated").build()
    p = row.flows["holding"]["source_p"]
    current = idle(p, float(model.relief.leakage * model.relief.conductance) * p)
    assert row.motor_current == pytest.approx(current, rel=1e-6)
    surplus = 10.0 * (row.battery_current - current)
    assert 0.0 < surplus < 5.0 * float(model.pump.tau) * (SUPPLY / float(re40().resistor.R) - current)


def test_variable_pump_with_purge_valve_holds() -> None:
    """The purge valve is closed, and the pump compensates for its own slip at the pressure of the held clutch."""
    row, model = ROWS["purge, variable pump"], named("purge, variable pump").build()
    p = float(model.clutch.rate) * STROKE / (0.25 * np.pi * float(model.slave.bore) ** 2)
    assert row.flows["holding"]["source_p"] == pytest.approx(p, rel=1e-6)
    assert row.motor_current == pytest.approx(idle(p), rel=1e-6)


@pytest.mark.thorough
def test_variable_pump_with_purge_valve_opens() -> None:
    """With the swash plate at full displacement from the start, it opens like a fixed pump on the same line."""
    model = replace(named("purge, variable pump").build(), {"pump.swash.x": 1.0})
    run = open_clutch(model, rtol=1e-8, save="end", account=False)
    assert run.t1 == pytest.approx(ROWS["bleed-off"].opening_time, rel=1e-6)
    assert ROWS["purge, variable pump"].opening_time > run.t1


def test_purge_valve_closes_the_clutch() -> None:
    """The pump recovers nothing: except for its slip, the energy of the open clutch is lost in the purge valve."""
    row, model = ROWS["purge, variable pump"], named("purge, variable pump").build()
    assert row.losses["purge"] > 0.8 * 0.5 * float(model.clutch.rate) * STROKE**2


def test_conditions() -> None:
    """Windings, magnets and viscosities as published."""
    cold, hot = (at_temperature(named("holding valve").build(), celsius, reference=40.0) for celsius in (-40.0, 100.0))
    assert cold.pump.liquid.viscosity / hot.pump.liquid.viscosity == pytest.approx(1200.0 / 2.5, rel=1e-6)
    assert cold.leak.resistance / hot.leak.resistance == pytest.approx(1200.0 / 2.5, rel=1e-6)
    copper = (1.0 + 3.93e-3 * 80.0) / (1.0 - 3.93e-3 * 60.0)
    for part in ("motor.resistor.R", "coil.R"):
        assert parameters(hot)[part] / parameters(cold)[part] == pytest.approx(copper, rel=1e-12)
    flux = (1.0 - 1.1e-3 * 80.0) / (1.0 + 1.1e-3 * 60.0)
    assert hot.motor.emf.k / cold.motor.emf.k == pytest.approx(flux, rel=1e-12)
    worn_out = worn(named("holding valve").build())
    assert worn_out.clutch.rate * STROKE == pytest.approx(800.0)


def lift_rate_when_open(model: Any) -> float:
    """The slope dl/dangle of the cam at the lift that fills the slave and compresses the liquid."""
    pressure = float(model.clutch.rate) * STROKE / float(model.slave.area)
    volume = float(model.slave.area) * STROKE + pressure / float(model.line.stiffness)
    lift, area = model.cam.profile.lift, float(model.master.area)
    angle = scipy.optimize.brentq(lambda angle: area * float(lift(angle)) - volume, 1.5, 3.1)
    return float(model.cam.profile.slope(angle))


def test_power_of_the_hold_under_conditions() -> None:
    """An eccentric held by its motor takes R (T/k)^2 for the torque T of its cam with a stiffer or softer line.

    The tolerance covers the transient until it is at rest.
    """
    row, base = ROWS["eccentric"], named("eccentric").build()
    for name, celsius in (("-30 C", -30.0), ("120 C", 120.0)):
        model = at_temperature(base, celsius, reference=40.0)
        torques = lift_rate_when_open(model) / lift_rate_when_open(base)
        ratio = model.motor.resistor.R / base.motor.resistor.R * (torques * base.motor.emf.k / model.motor.emf.k) ** 2
        assert row.conditions[name]["holding_power"] == pytest.approx(row.holding_power * float(ratio), rel=5e-3)
    assert row.conditions["worn"]["holding_power"] > 1.2 * row.holding_power


def test_numbers_that_are_zero_have_no_sign() -> None:
    row = dataclasses.replace(ROWS["screw"], motor_current=-1e-9, battery_current=-1e-9, holding_power=-1e-9)
    assert "-0.0" not in as_text([row])


def test_the_table_of_limits_has_names_for_all_paths() -> None:
    """All sizes and losses have names, and the table contains no path of a model."""
    assert set(SIZES) == {path for row in ROWS.values() for path in row.gradients}
    assert set(LOSSES) == {path for row in ROWS.values() for path in row.losses}
    table = limits_as_text(list(ROWS.values()))
    assert not [path for path in (*SIZES, *LOSSES) if "." in path and path in table]


def test_what_limits_an_opening() -> None:
    """Valves if most of the pressure is lost there; otherwise the motor, by its current or its speed."""
    base, model = ROWS["eccentric"], named("eccentric").build()
    assert limits(base, model)[1].startswith("motor current")
    free = dataclasses.replace(base, gradients={**base.gradients, "motor.resistor.R": 0.0})
    assert limits(free, model)[1].startswith("motor speed")
    flows = {**base.flows, "opening": {"source_p": 4e6, "source_q": 1e-4, "clutch_p": 1e6, "clutch_q": 1e-4}}
    assert "75 % of the pressure" in limits(dataclasses.replace(base, flows=flows), model)[1]
    assert limits(base, model)[2:4] == ("bore of the master cylinder", "-1.45 %")


@pytest.mark.parametrize("volume", [0.7e-4, 1e-4, 2e-4])
def test_accumulator_starts_in_the_middle_of_its_band(volume: float) -> None:
    """The start pressure is the mean for every size, by p v^1.4 = const of the gas."""
    sizes = {"accumulator.volume": volume, "accumulator.capacity": 0.8 * volume}
    model = charged(replace(named("automated gearbox").build(), sizes))
    gas, air = model.accumulator, 101325.0
    pressure = (3e6 + air) * (volume / (volume - float(gas.V))) ** 1.4 - air
    assert pressure == pytest.approx(float(model.wanted.k), rel=1e-12)
    assert float(model.gallery.p) == float(model.wanted.k)


def rectangles(panel: Axes) -> list[Rectangle]:
    return [patch for patch in panel.patches if isinstance(patch, Rectangle)]


def test_pictures() -> None:
    """The areas of a row add up to that of its source; pumps show their no-load set, two actuators measurements."""
    rows, titles = list(ROWS.values()), {item.name: item.title for item in ARCHITECTURES}
    pumps = sum("no-load set" in row.conditions for row in rows)
    figure = plot_areas(rows[:2], titles)
    for panel, flows in zip(figure.axes, [flows for row in rows[:2] for flows in row.flows.values()], strict=True):
        drawn = sum(patch.get_width() * patch.get_height() for patch in rectangles(panel))
        assert drawn == pytest.approx(1e-5 * 6e4 * flows["source_p"] * flows["source_q"], rel=1e-9)
    for panel, name in zip(plot_figures(rows, titles).axes, ("opening", "held", "energy"), strict=True):
        assert name in panel.get_xlabel()
        ends = [bar.get_x() + bar.get_width() for bar in rectangles(panel)]
        marks = [float(x) for line in panel.lines for x in np.asarray(line.get_xdata())]
        assert len(ends) == len(rows)
        assert len(marks) == {"opening": pumps + 2, "held": 1, "energy": pumps}[name]
        assert panel.get_xlim()[1] > max(ends + marks)
    left, right = plot_energies(rows, titles).axes
    for panel, total in (
        (left, sum(sum(row.losses.values()) for row in rows)),
        (right, sum(row.energy for row in rows)),
    ):
        assert sum(bar.get_width() for bar in rectangles(panel)) == pytest.approx(total)
        assert panel.get_xlim()[1] > max(bar.get_x() + bar.get_width() for bar in rectangles(panel))
    assert {kind_of(path) for row in rows for path in row.losses} >= {"winding", "pump", "valves", "surplus flow"}


@pytest.mark.thorough
def test_eccentric_opens_as_without_a_controller() -> None:
    """The controller saturates during the opening."""
    time = next(time for design, keywords, time in OPENING_TIMES if design == "ema_maxon" and not keywords)
    run = open_clutch(named("eccentric").build(), rtol=1e-8, save="end", account=False)
    assert run.result == Result.stopped
    assert run.t1 == pytest.approx(time, rel=1e-7)
    assert ROWS["eccentric"].opening_time == pytest.approx(time, rel=1e-7)


@pytest.mark.slow
def test_rows_are_those_of_the_study() -> None:
    for row in study():
        old = ROWS[row.architecture]
        assert row.opening_time == pytest.approx(old.opening_time, rel=1e-6)
        assert row.energy == pytest.approx(old.energy, rel=1e-4)
        for path, slope in row.gradients.items():
            assert slope == pytest.approx(old.gradients[path], rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("name", list(ROWS))
def test_gradients_are_those_of_differences(name: str) -> None:
    """Fourth-order differences at a tight tolerance, in one direction over all sizes."""
    architecture, rtol, h = named(name), 1e-11, 1e-4
    model = architecture.build()
    sizes, time = sizes_of(architecture, model), jax.jit(opening_time_of(architecture, model, rtol))
    direction = np.asarray(sizes) * np.linspace(0.5, 1.0, len(sizes))
    near = [float(time(sizes + step * h * direction)) for step in (-2, -1, 1, 2)]
    difference = (8.0 * (near[2] - near[1]) - (near[3] - near[0])) / (12.0 * h)
    gradients, _ = gradients_of(architecture, model, rtol)
    slope = sum(step * gradients[path] for step, path in zip(direction, architecture.sizes, strict=True))
    assert slope == pytest.approx(difference, rel=1e-5, abs=1e-7 * ROWS[name].opening_time)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["constant pressure", "eccentric"])
def test_gradients_are_those_of_reverse_mode(name: str) -> None:
    """Backpropagation through the accepted steps."""
    architecture = named(name)
    model, adjoint = architecture.build(), diffrax.RecursiveCheckpointAdjoint()

    def time(values: Any) -> Any:
        changed = replace(model, dict(zip(architecture.sizes, values, strict=True)))
        return simulate(changed, 1.0, until=lambda s: s.piston.a.s - STROKE, save="end", rtol=1e-8, adjoint=adjoint).t1

    gradient = jax.jit(jax.grad(time))(sizes_of(architecture, model))
    expected, _ = gradients_of(architecture, model, 1e-8)
    for path, slope in zip(architecture.sizes, gradient.tolist(), strict=True):
        assert slope == pytest.approx(expected[path], rel=1e-5)


@pytest.mark.slow
def test_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from studies.architectures import _main

    monkeypatch.setattr(_main, "ARCHITECTURES", (named("eccentric"),))
    _main.main(tmp_path / "rows.json", tmp_path)
    assert [Row(**row).architecture for row in json.loads((tmp_path / "rows.json").read_text())["rows"]] == [
        "eccentric"
    ]
    for name in (
        "architectures.html",
        "architectures_areas.png",
        "architectures_energy.png",
        "architectures_figures.png",
    ):
        assert (tmp_path / name).stat().st_size > 10_000
