"""Consistency between studies: the same figure has the same value in all of them."""

from typing import Any

import numpy as np
import pytest
from _designs import DESIGNS

from acausal import parameters, replace
from studies import architectures, catalogue, control, identify, validate
from studies._measured import DEAD_TIME, FULL, MEASURED, measured
from studies.actuators import NO_LOAD_FRICTION, concluding_table, motor_held, valve_held
from studies.beyond._prototypes import PROTOTYPES
from studies.concepts._concepts import CONCEPTS, MOTORS
from studies.concepts._rows import prototypes
from studies.design import PROBLEMS as DESIGNED
from studies.hold._plot import MEASURED as HELD
from studies.optimise._problems import PROBLEMS as OPTIMISED

BUILT = {item.name: item.build for item in architectures.ARCHITECTURES}
CASES: list[tuple[str, Any, str, set[str]]] = [
    *(
        (f"architectures, {name}", BUILT[name], "ema_maxon", set[str]())
        for name in ("eccentric", "crank", "ball screw", "screw")
    ),
    *(
        (f"architectures, {name}", build, "ehs_maxon", {"slave.bore"} if "EHA" in name else set[str]())
        for name, build in BUILT.items()
        if hasattr(build(), "pump")
    ),
    ("architectures, worm", BUILT["worm"], "sila", set()),
    ("hold, motor", motor_held, "ehs_maxon", set()),
    ("hold, valve", valve_held, "ehs_maxon", set()),
    *(
        (f"beyond, {name}", prototype.build, design, set())
        for (name, prototype), design in zip(PROTOTYPES.items(), ("ema_fise", "ema_maxon", "ehs_maxon"), strict=True)
    ),
    ("concepts, EMA", lambda: CONCEPTS[0].model, "ema_maxon", {"cam.profile.eccentricity"}),
    ("concepts, EHS", lambda: CONCEPTS[1].model, "ehs_maxon", set()),
    *(
        (f"optimise, {one.actuator}", lambda one=one: one.model(one.built), one.actuator, set[str]())
        for one in OPTIMISED
    ),
    *(
        (f"design, {one.name}", lambda one=one: one.model, design, set[str]())
        for one, design in zip(DESIGNED, ("ema_fise", "ema_maxon", "ehs_maxon"), strict=False)
    ),
    *((f"control, {name}", lambda one=one: one, name, set[str]()) for name, (one, _) in control.ACTUATORS.items()),
    ("identify", lambda: identify.TRUE, "ema_maxon", set()),
]  # fmt: skip


@pytest.mark.parametrize(("study", "build", "design", "others"), CASES, ids=[case[0] for case in CASES])
def test_one_set_of_parameters(study: str, build: Any, design: str, others: set[str]) -> None:
    """All parameters that a model shares with a design are equal, except those that the study changes."""
    own, base = parameters(build()), parameters(DESIGNS[design]())
    shared = own.keys() & base.keys()
    assert {"motor.resistor.R", "motor.emf.k", "piston.m", "clutch.rate"} <= shared
    differing = {path for path in shared if not np.allclose(own[path], base[path], rtol=1e-12, atol=0.0)}
    assert differing <= others, study


def _row(actuator: str, quantity: str) -> validate.Row:
    rows = [row for row in validate.stored() if (row.actuator, row.condition) == (actuator, "base")]
    return next(row for row in rows if row.quantity == quantity)


def _validated(actuator: str, quantity: str) -> float:
    return _row(actuator, quantity).model


def test_comparison_and_architectures() -> None:
    """Opening time and currents of the RE50 with its eccentric agree; the worm holds without current in both."""
    rows = {row.architecture: row for row in architectures.stored()}
    assert rows["eccentric"].opening_time == pytest.approx(_validated("ema_maxon", "opening_time"), rel=1e-6)
    assert rows["eccentric"].motor_current == pytest.approx(_validated("ema_maxon", "holding_current"), rel=1e-6)
    assert rows["eccentric"].peak_current == pytest.approx(_validated("ema_maxon", "peak_current"), rel=1e-9)
    assert rows["worm"].motor_current == pytest.approx(_validated("sila", "holding_current"), abs=1e-3)
    assert rows["worm"].peak_current == pytest.approx(_validated("sila", "peak_current"), rel=1e-9)


PUMPS = [name for name, build in BUILT.items() if hasattr(build(), "pump")]
SLIP_FREE = {"pump.losses.C_s": 0.0}


@pytest.mark.thorough
def test_pump_of_the_architectures() -> None:
    """A pump without slip opens like the EHS of the comparison, with either set, because its valve is closed."""
    model, told = replace(BUILT["bleed-off"](), SLIP_FREE), _row("ehs_maxon", "opening_time")
    for friction, time in ((model.motor.bearing.C, told.model), (NO_LOAD_FRICTION, told.no_load)):
        opened = architectures.open_clutch(replace(model, {"motor.bearing.C": friction}), rtol=1e-9, save="end")
        assert opened.t1 == pytest.approx(time, rel=1e-6)


def test_prototype_with_its_valve() -> None:
    """Slip, valve and chamber delay the prototype by at most 4 %, with either set; it opens later than the RE50."""
    rows = {row.architecture: row for row in architectures.stored()}
    told = _row("ehs_maxon", "opening_time")
    prototype = rows["holding valve"]
    pairs = ((prototype.opening_time, told.model), (prototype.conditions["no-load set"]["opening_time"], told.no_load))
    for found, without in pairs:
        assert without is not None
        assert without < found < 1.04 * without
    assert prototype.opening_time > rows["eccentric"].opening_time


@pytest.mark.parametrize("name", PUMPS)
def test_peak_current_of_the_pumps(name: str) -> None:
    """The stall current at full voltage, for every circuit."""
    row = next(row for row in architectures.stored() if row.architecture == name)
    assert row.peak_current == pytest.approx(_validated("ehs_maxon", "peak_current"), rel=1e-9)


def test_held_by_the_motor_of_a_closed_circuit() -> None:
    """As in the comparison, plus the friction of the motor that compensates for slip: w = C_s p/mu, i = C w/k."""
    row = next(row for row in architectures.stored() if row.architecture == "EHA, servo motor")
    model = BUILT["EHA, servo motor"]()
    viscosity = model.pump.liquid.viscosity * model.pump.liquid.density
    speed = model.pump.losses.C_s * row.flows["holding"]["source_p"] / viscosity
    turning = float(model.motor.bearing.C * speed / model.motor.emf.k)
    assert row.motor_current == pytest.approx(_validated("ehs_maxon", "holding_current") + turning, rel=1e-3)


def test_no_load_set_appears_with_the_other_set() -> None:
    """Results with the no-load set appear together with those of the set of all studies."""
    rows = [row for row in validate.stored() if row.actuator == "ehs_maxon" and row.quantity == "opening_time"]
    assert all(row.no_load is not None and row.no_load < row.model for row in rows)
    text = architectures.measured_as_text()
    assert f"{1e3 * rows[0].model:.1f}" in text
    assert f"{1e3 * (rows[0].no_load or 0.0):.1f}" in text
    compared = architectures.stored()
    for row in compared:
        assert ("no-load set" in row.conditions) == (row.architecture in PUMPS)
        for figures in (row.conditions[name] for name in row.conditions if name == "no-load set"):
            assert f"  {1e3 * row.opening_time:.1f}  " in architectures.as_text(compared)
            assert f"  {1e3 * figures['opening_time']:.1f}  " in architectures.as_text(compared)


@pytest.mark.thorough
def test_concluding_table() -> None:
    """Opening times, peak and holding currents of the three prototypes are those of the comparison."""
    for actuator, (_, found) in zip(("ema_fise", "ema_maxon", "ehs_maxon"), concluding_table().values(), strict=True):
        for quantity in ("opening_time", "peak_current", "holding_current"):
            assert getattr(found, quantity) == pytest.approx(_validated(actuator, quantity), rel=1e-6)


@pytest.mark.thorough
def test_concepts() -> None:
    """The prototypes agree with the comparison for the spring of the test rig, and with a worn clutch for 800 N."""
    built = prototypes()
    actuators = ("ema_fise", "ema_maxon", "ehs_maxon")
    for actuator, with_spring in zip(actuators, built[::2], strict=True):
        for quantity in ("opening_time", "holding_current"):
            assert getattr(with_spring, quantity) == pytest.approx(_validated(actuator, quantity), rel=1e-6)
    worn = next(row for row in architectures.stored() if row.architecture == "eccentric").conditions["worn"]
    assert worn["opening_time"] == pytest.approx(built[3].opening_time, rel=1e-6)


@pytest.mark.parametrize("actuator", MEASURED)
def test_measured_figures_are_read_once(actuator: str) -> None:
    stated = [row for row in validate.stored() if row.actuator == actuator and "measured" in row.source]
    for row in stated:
        if row.condition == "base" and (actuator, row.quantity) != ("ehs_maxon", "holding_current"):
            assert row.thesis == measured(actuator, row.quantity.replace("_", " "))
    shown = next(one for one in OPTIMISED if one.actuator == actuator)
    assert shown.measured == measured(actuator, "opening time")


def test_measured_figures_of_the_pump() -> None:
    """The thesis prints holding currents of 18 A and about 20 A: the studies use the mean, or show the range."""
    current = MEASURED["ehs_maxon"][FULL]["holding current"]
    assert (current.value - current.sigma, current.value + current.sigma) == HELD
    assert catalogue.MEASURED["RE 40 with pump"] == (DEAD_TIME["opening time"].value, current.value)
    assert catalogue.MEASURED["RE 50 with cam"] == (measured("ema_maxon", "opening time"), 23.0)


def test_motors_of_the_prototypes() -> None:
    for motor, design in zip(MOTORS[:3], ("ema_fise", "ema_maxon", "ehs_maxon"), strict=True):
        base = parameters(DESIGNS[design]())
        assert motor.values == pytest.approx({path: float(base[path]) for path in motor.values}, rel=1e-12)
