"""The comparison with the thesis."""

import dataclasses
from pathlib import Path
from typing import Any

import equinox as eqx
import numpy as np
import pytest
from _designs import DESIGNS
from _thesis_reference import HOLDING, MODES, OPENING_TIMES
from scipy.optimize import brentq

from acausal import linearise
from components.electrical import ConstantCurrent
from studies import prototypes
from studies.validate import as_text, counts, hold, mode_frequencies, set_as_text, stored
from studies.validate._statements import KINDS, statements

KEYS = {"actuator", "quantity", "condition", "source", "unit", "thesis", "model", "no_load", "kind", "reason"}
BASE_UNITS = {
    "opening_time": "s", "peak_current": "A", "holding_current": "A", "holding_power": "W", "battery_current": "A",
    "mode_frequency_1": "Hz", "mode_frequency_2": "Hz",
}  # fmt: skip


def test_stored_rows_are_what_the_thesis_states() -> None:
    """They are shown on the page of the comparison."""
    wanted = [item for actuator in DESIGNS for item in statements(actuator)]
    assert [(r.actuator, r.quantity, r.condition, r.source, r.thesis, r.kind, r.reason) for r in stored()] == [
        (w.actuator, w.quantity, w.condition, w.source, w.value, w.kind, w.reason) for w in wanted
    ]


def test_stored_parameters_are_those_that_the_prototypes_show() -> None:
    """The identified parameters of tables 8.1 to 8.3."""
    names = {"identified_resistance": "motor.resistor.R", "identified_friction": "motor.bearing.C"}
    shown = {
        (row.prototype, row.parameter): (row.thesis, row.estimate)
        for row in prototypes.stored().rows
        if row.case in ("all data", "times and peaks")
    }
    found = [row for row in stored() if row.quantity in names]
    assert len(found) == 6
    for row in found:
        assert (row.thesis, row.model) == pytest.approx(shown[row.actuator, names[row.quantity]], rel=1e-5)


def test_stored_speeds_without_load() -> None:
    """The torque of the motor equals that of its friction, which is zero if the row says so."""
    given = {"ema_fise": (0.133, 16e-4, 0.0064), "ema_maxon": (0.309, 4e-3, 0.0385), "ehs_maxon": (0.4, 4e-3, 0.0302)}
    found = [row for row in stored() if row.quantity == "no_load_speed"]
    assert len(found) == 6
    for row in found:
        resistance, friction, k = given[row.actuator]
        rubbing = 0.0 if "friction=0" in row.condition else friction * row.model
        voltage = float(row.condition.split(",")[0].removeprefix("voltage="))
        assert k * (voltage - k * row.model) / resistance == pytest.approx(rubbing, abs=1e-9)


def test_four_counts() -> None:
    """Each figure of the thesis is counted once; figures that the set is based on are no test of the model."""
    found = {one.kind: one for one in counts(stored())}
    stated = [row for row in stored() if row.thesis is not None]
    assert list(found) == list(KINDS)
    assert sum(one.figures for one in found.values()) == len(stated)
    assert sum(one.reproduced for one in found.values()) == sum(bool(row.reproduced) for row in stated)
    assert all(row.kind == "refitted" for row in stated if row.quantity.startswith("identified"))


def test_a_figure_of_zero_is_reproduced_by_zero_alone() -> None:
    held = next(row for row in stored() if row.actuator == "sila" and row.quantity == "holding_current")
    assert (held.thesis, held.model, held.deviation) == (0.0, 0.0, 0.0)
    assert dataclasses.replace(held, model=1e-3).reproduced is False


def test_notes_follow_the_tables_and_are_few() -> None:
    text = as_text(stored())
    first = text.index("\n(1) ")
    assert text.rindex("opening time [ms]") < first
    notes = [line for line in text[first:].splitlines() if line.startswith("(")]
    assert len(notes) <= 15
    assert all(f"({number})" in text[:first] for number in range(1, len(notes) + 1))


def test_display_units() -> None:
    """No figure is shown in seconds, radians per second, pascals or newtons per metre."""
    text = as_text(stored()) + set_as_text()
    assert not [unit for unit in ("[s]", "[rad/s]", "[Pa]", "N/m]", "[N.m.s/rad]", "m3/rad") if unit in text]


@pytest.mark.slow
def test_stored_rows_are_those_of_the_study(validated: list[dict[str, Any]]) -> None:
    for row, old in zip(validated, stored(), strict=True):
        assert row["model"] == pytest.approx(old.model, rel=1e-5)
        assert row["no_load"] == pytest.approx(old.no_load, rel=1e-5)


@pytest.mark.slow
def test_rows(validated: list[dict[str, Any]]) -> None:
    for row in validated:
        assert set(row) == KEYS
        assert row["unit"] == BASE_UNITS.get(row["quantity"], row["unit"])
        assert row["thesis"] is None or row["thesis"] >= 0.0
        assert row["kind"] in KINDS
        assert row["model"] >= 0.0
    base = {(row["actuator"], row["quantity"]) for row in validated if row["condition"] == "base"}
    assert base >= {(design, quantity) for design in DESIGNS for quantity in BASE_UNITS}
    stated = [(row["actuator"], row["quantity"], row["condition"], row["source"]) for row in validated]
    assert len(stated) == len(set(stated))


# Figures that the model reproduces with one set of parameters: actuator, quantity, condition, source.
REPRODUCED = {
    ("ema_fise", "opening_time", "base", "Fig. 6.6, simulated"),
    ("ema_fise", "opening_time", "base", "concluding table"),
    ("ema_fise", "holding_current", "base", "Fig. 7.4, measured"),
    ("ema_fise", "least_ratio", "base", "chapter 6, at 12 N.m behind 38:1"),
    ("ema_maxon", "best_ratio", "voltage=9.45", "chapter 6, as built"),
    ("ehs_maxon", "opening_time", "base", "Fig. 7.10, 30 ms of it at rest, measured"),
    ("ehs_maxon", "holding_current", "base", "chapter 7, text, measured, about"),
}


@pytest.mark.slow
def test_what_is_reproduced_and_why_the_rest_is_not(validated: list[dict[str, Any]]) -> None:
    stated = [row for row in validated if row["thesis"] is not None]
    near = {
        (row["actuator"], row["quantity"], row["condition"], row["source"])
        for row in stated
        if abs(row["model"] - row["thesis"]) <= 0.05 * row["thesis"]
    }
    assert near >= REPRODUCED
    assert {row["quantity"] for row in stated if row["actuator"] == "sila"} >= {"static_gain", "kinetic_slave_1"}
    for row in stated:
        key = (row["actuator"], row["quantity"], row["condition"], row["source"])
        assert key in near or row["reason"], row
        assert key in near or row["actuator"] != "sila" or row["quantity"] == "displacement_motor_2"


def _model(rows: list[dict[str, Any]], design: str, quantity: str, condition: str = "base") -> float:
    values = {(row["actuator"], row["quantity"], row["condition"]): row["model"] for row in rows}
    return values[design, quantity, condition]


@pytest.mark.slow
def test_opening_times(validated: list[dict[str, Any]]) -> None:
    for design, keywords, time in OPENING_TIMES:
        if not keywords:
            assert _model(validated, design, "opening_time") == pytest.approx(time, rel=1e-8)
    slower = _model(validated, "ema_maxon", "opening_time", "voltage=9.45")
    assert slower == pytest.approx(OPENING_TIMES[4][2], rel=1e-8)


@pytest.mark.slow
def test_currents(validated: list[dict[str, Any]]) -> None:
    for design, current, _ in HOLDING:
        assert _model(validated, design, "holding_current") == pytest.approx(current, rel=1e-10)
    for design, resistance in (("ema_fise", 0.133), ("ema_maxon", 0.309), ("ehs_maxon", 0.4)):
        assert _model(validated, design, "peak_current") == pytest.approx(13.5 / resistance, rel=1e-10)


@pytest.mark.parametrize(("design", "keywords", "frequencies"), MODES)
def test_modes(design: str, keywords: dict[str, float], frequencies: tuple[float, float]) -> None:
    np.testing.assert_allclose(mode_frequencies(DESIGNS[design](**keywords), 6e-3), frequencies, rtol=1e-8)


@pytest.mark.slow
def test_modes_under_load(validated: list[dict[str, Any]]) -> None:
    """Against hand-written equations with two degrees of freedom: motor angle and stroke."""
    model = DESIGNS["ema_fise"]()
    rest = hold(model, 6e-3)
    ratio, angle = 12.0, float(rest.angle) / 12.0

    def lift(angle: float) -> float:
        return -5.5e-3 * np.cos(angle) + np.sqrt(20e-3**2 - (5.5e-3 * np.sin(angle)) ** 2)

    slope = (lift(angle + 1e-5) - lift(angle - 1e-5)) / 2e-5
    curvature = (lift(angle + 1e-3) - 2 * lift(angle) + lift(angle - 1e-3)) / 1e-6
    master, slave = 0.25 * np.pi * 19.05e-3**2, 0.25 * np.pi * 17.4625e-3**2
    volumes = np.array([master * slope / ratio, -slave])  # per motor angle and stroke
    stiffness = 149408526513837.7 * np.outer(volumes, volumes)
    stiffness += np.diag([master * curvature * float(rest.pressure) / ratio**2, 58e3])
    squares = np.linalg.eigvals(np.diag([1 / (61.5e-6 + 3.49e-5 / ratio**2), 1 / 0.3]) @ stiffness)
    expected = np.sqrt(np.sort(squares)) / (2 * np.pi)
    condition = "held against the spring"
    assert _model(validated, "ema_fise", "mode_frequency_1", condition) == pytest.approx(expected[0], rel=1e-6)
    assert _model(validated, "ema_fise", "mode_frequency_2", condition) == pytest.approx(expected[1], rel=1e-6)


@pytest.mark.thorough
def test_geometric_stiffness() -> None:
    """The published point: 6 mm, with the cam at its unloaded angle and the pressure of the spring."""
    model = DESIGNS["ema_fise"]()
    free = eqx.tree_at(lambda m: (m.motor.bearing.C, m.line.damping, m.seal.C), model, (0.0, 0.0, 0.0))
    free = eqx.tree_at(lambda m: m.supply, free, ConstantCurrent(I=0.0))
    pressure = 58e3 * 6e-3 / (0.25 * np.pi * 17.4625e-3**2)
    lift = 6e-3 * (17.4625 / 19.05) ** 2
    cam = brentq(lambda angle: float(model.cam.profile.lift(angle)) - lift, 0.1, 2.0, xtol=1e-14)
    system = linearise(free)
    values = {"line.V": pressure / 149408526513837.7, "slave.rod.s": 6e-3, "gearbox.carrier.phi": cam}
    modes = linearise(free, at=[values.get(name, 0.0) for name in system.states]).modes
    np.testing.assert_allclose(modes.frequency[-1], 854.147955979504, rtol=1e-9)
    np.testing.assert_allclose(modes.frequency[-3], 2.949966996237943, rtol=1e-9)


@pytest.mark.thorough
def test_channels_of_a_stiff_actuator() -> None:
    """Voltage to stroke has three more poles than zeros, despite a pole of 1e5 1/s and units of metres and pascals."""
    model = DESIGNS["ema_fise"]()
    system = linearise(model, at=[1e-9, 6e-3, 0.0, 1.0, 0.0], inputs=["supply.V"], outputs=["slave.rod.s", "line.p"])
    assert len(system.minimal().states) == 4
    # The damping and stiffness of the liquid, and the piston on the clutch spring.
    np.testing.assert_allclose(system.channel("slave.rod.s").zeros, [-149408526513837.7 / 6.8e11], rtol=1e-6)
    piston = np.roots([0.3, 2e-3, 58e3])
    expected = [-149408526513837.7 / 6.8e11, *piston[np.argsort(-piston.imag)]]
    np.testing.assert_allclose(system.channel("line.p").zeros, expected, rtol=1e-6)
    low = system.frequency_response(1e-5)
    np.testing.assert_allclose(system.dc_gain, low.real, rtol=1e-6)


@pytest.mark.slow
def test_pictures(validated: list[dict[str, Any]], folder: Path) -> None:
    for name in ("", "_openings", "_deviations", "_linear", "_bond_graph", "_bond_graph_whole"):
        assert (folder / "pictures" / f"validate{name}.png").stat().st_size > 10_000
    assert "data:image/png" in (folder / "pictures" / "validate.html").read_text()
