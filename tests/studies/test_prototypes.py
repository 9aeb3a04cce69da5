"""`python -m studies prototypes`."""

import json
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from _designs import DESIGNS
from _thesis_reference import HOLDING

from studies.__main__ import main
from studies.prototypes import stored
from studies.prototypes._cases import CASES, held, model_of
from studies.prototypes._proposals import NOISES, Prediction, predictions, separations
from studies.prototypes._tables import STORED

# Parameters with which hand-written equations, integrated to 1e-12, reproduce the measurements.
RE50 = {"motor.resistor.R": 0.1453, "motor.bearing.C": 8.715e-3}  # from its two opening times only
LOST_VOLUME = 1.075e-6  # m3, with a resistance of 0.4 ohm


def predicted(values: list[float], *moved: list[float]) -> dict[str, Prediction]:
    """The same prediction for every measurement on the RE50."""
    directions = np.reshape(moved, (len(moved), len(values)))
    return dict.fromkeys(NOISES["RE50"], Prediction(np.array(values), directions))


def distances(**found: dict[str, Prediction]) -> dict[str, float]:
    return {one.explanations: one.distance for one in separations("RE50", found) if one.measurement.endswith("closing")}


def test_separations() -> None:
    """In standard deviations of a noise of 0.5 A and the parameters; zero for two infinite predictions."""
    single = distances(a=predicted([1.0]), b=predicted([4.0], [2.0]), c=predicted([math.inf]), d=predicted([math.inf]))
    assert single["a / b"] == pytest.approx(3.0 / math.hypot(0.5, 2.0))
    assert single["a / c"] == math.inf
    assert single["c / d"] == 0.0
    # If the parameters decide whether a prediction is finite, the distance is zero.
    open_end = distances(b=predicted([4.0]), c=predicted([math.inf]), e=predicted([1.0], [math.inf]))
    assert open_end == {"b / c": math.inf, "b / e": 0.0, "c / e": 0.0}
    # In a record, differences that the parameters can explain do not count; other differences do.
    alike = distances(a=predicted([0.0, 0.0], [50.0, 50.0]), b=predicted([10.0, 10.0]))["a / b"]
    other = distances(a=predicted([0.0, 0.0], [50.0, 50.0]), b=predicted([10.0, -10.0]))["a / b"]
    assert alike == pytest.approx(10.0 * math.sqrt(2.0) / math.hypot(0.5, 50.0 * math.sqrt(2.0)))
    assert other == pytest.approx(10.0 * math.sqrt(2.0) / 0.5)


def test_predictions_scatter_as_their_parameters() -> None:
    """For a prediction linear in the parameters, the variance is g' S g."""
    covariance = np.array([[4e-4, -3e-6], [-3e-6, 1e-7]])
    fit: Any = SimpleNamespace(
        names=("motor.resistor.R", "motor.bearing.C"), estimates=np.array([0.15, 7e-3]), covariance=covariance,
        model=DESIGNS["ema_maxon"](resistance=0.15, friction=7e-3),
    )  # fmt: skip
    slope = np.array([2.0, -30.0])
    linear = predictions(
        {"a": fit}, {"a": lambda m: {"x": slope[0] * m.motor.resistor.R + slope[1] * m.motor.bearing.C}}
    )
    values, moved = linear["a"]["x"]
    np.testing.assert_allclose(values, slope @ fit.estimates)
    np.testing.assert_allclose(np.linalg.norm(moved), np.sqrt(slope @ covariance @ slope))


def test_current_that_holds() -> None:
    """At the onset of motion: without friction as at rest; with friction, more to open than to close."""
    for design, current, _ in HOLDING:
        assert held(DESIGNS[design]()) == pytest.approx(current, rel=1e-10)
    sticky = model_of(next(case for case in CASES if "friction.Tc" in case.free))
    assert held(sticky) - held(sticky, direction=-1.0) == pytest.approx(2.0 * 0.1 / 0.0385, rel=1e-9)


def test_stored_fits_are_those_of_the_stored_comparisons() -> None:
    """The sum of squares of a case is that of its measurements, unless it has priors."""
    found = stored()
    compared = 0
    for outcome in found.outcomes:
        case = (outcome.prototype, outcome.case)
        meetings = [row for row in found.meetings if (row.prototype, row.case) == case]
        parameters = [row for row in found.rows if (row.prototype, row.case) == case]
        squares = sum(((row.fitted - row.measured) / row.sigma) ** 2 for row in meetings)
        assert squares < outcome.chi2 * (1.0 + 1e-9)
        if outcome.dof == len(meetings) - len(parameters):
            assert outcome.chi2 == pytest.approx(squares, rel=1e-9)
            compared += 1
    assert compared >= 4


def test_stored_predictions_are_those_of_the_stored_estimates() -> None:
    """Predictions that need no run, by closed forms."""
    found, volts, k = stored(), 13.5, 0.0385
    for what in ("different torque constant", "dry friction", "gear losses"):
        values = {row.parameter: row.estimate for row in found.rows if row.case == f"all data, {what}"}
        said = {row.measurement: row.predicted for row in found.proposals if row.explanation == what}
        emf, dry = values.get("motor.emf.k", k), values.get("friction.Tc, friction.Ts", 0.0)
        r, c = values["motor.resistor.R"], values["motor.bearing.C"]
        speed = (volts * emf / r - dry) / (emf**2 / r + c)
        assert said["generator voltage of the motor at 1000 rpm"] == pytest.approx(emf * 1000.0 * math.pi / 30.0)
        assert said["no-load current of motor and gear at 13.5 V"] == pytest.approx((volts - emf * speed) / r)
        assert said["breakaway current of motor and gear"] == pytest.approx(dry / emf)


def test_stored_distances_are_those_of_the_stored_predictions() -> None:
    """For scalars, the distance is the difference divided by the root of the sum of all variances."""
    found = stored()
    said = {(row.measurement, row.explanation): row for row in found.proposals}
    compared = 0
    for row in found.separations:
        a, b = (said.get((row.measurement, name)) for name in row.explanations.split(" / "))
        if a is None or b is None or math.isinf(row.distance):
            continue
        if math.isinf(a.spread + b.spread):
            assert row.distance == 0.0
            continue
        blur = math.sqrt(a.noise**2 + a.spread**2 + b.spread**2)
        assert row.distance == pytest.approx(abs(a.predicted - b.predicted) / blur, rel=1e-9)
        compared += 1
    assert compared > 20


@pytest.fixture(scope="module")
def tables(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[dict[str, Any]]]:
    folder: Path = tmp_path_factory.mktemp("prototypes")
    main(["prototypes", "--json", str(folder / "rows.json"), "--out", str(folder)])
    pictures = {"prototypes_re50", "prototypes_re50_proposals", "prototypes_dead_time"}
    assert {path.stem for path in folder.glob("*.png")} == pictures | {"prototypes_dead_time_proposals"}
    assert "data:image/png" in (folder / "prototypes.html").read_text()
    return json.loads((folder / "rows.json").read_text())


def _estimates(rows: list[dict[str, Any]], prototype: str, case: str) -> dict[str, dict[str, Any]]:
    return {row["parameter"]: row for row in rows if (row["prototype"], row["case"]) == (prototype, case)}


@pytest.mark.slow
def test_estimates(tables: dict[str, list[dict[str, Any]]]) -> None:
    fise = _estimates(tables["rows"], "ema_fise", "all data")
    assert fise["motor.resistor.R"]["estimate"] == pytest.approx(13.5 / 200.0, rel=1e-6)
    # The data add nothing to the priors of damping and seal.
    for name in ("line.damping", "seal.C"):
        assert fise[name]["estimate"] == pytest.approx(fise[name]["thesis"], rel=0.01)
    re50 = _estimates(tables["rows"], "ema_maxon", "times and peaks")
    for name, expected in RE50.items():
        assert re50[name]["low"] < expected < re50[name]["high"]
        assert not re50[name]["low"] < re50[name]["thesis"] < re50[name]["high"]
    volume = _estimates(tables["rows"], "ehs_maxon", "dead time: empty volume")["pocket.capacity"]
    assert volume["low"] < LOST_VOLUME < volume["high"]


@pytest.mark.slow
def test_what_can_meet_the_measurements(tables: dict[str, list[dict[str, Any]]]) -> None:
    """Sums of squares over the measurements of each case."""
    squares: dict[str, float] = {}
    for row in tables["meetings"]:
        key = f"{row['prototype']} {row['case']}"
        squares[key] = squares.get(key, 0.0) + ((row["fitted"] - row["measured"]) / row["sigma"]) ** 2
    assert squares["ema_maxon all data, viscous friction only"] > 15.0
    for what in ("different torque constant", "dry friction", "gear losses"):
        assert squares[f"ema_maxon all data, {what}"] < 5.0
    for what in ("late voltage", "stuck near stall", "rising voltage", "empty volume"):
        assert squares[f"ehs_maxon dead time: {what}"] < 2.0
    assert squares["ehs_maxon dead time: rising voltage, friction of the no-load test"] > 10.0  # its peak current


@pytest.mark.slow
def test_what_tells_the_explanations_apart(tables: dict[str, list[dict[str, Any]]]) -> None:
    best: dict[tuple[str, str], float] = {}
    for row in tables["separations"]:
        pair = (row["subject"], row["explanations"])
        best[pair] = max(best.get(pair, 0.0), math.inf if row["distance"] is None else row["distance"])
    assert len(best) == 3 + 6
    assert min(best.values()) > 3.0


@pytest.mark.slow
def test_stored_tables_are_those_of_the_command(tables: dict[str, list[dict[str, Any]]]) -> None:
    old = json.loads(STORED.read_text())
    assert list(tables) == list(old)
    for name, rows in tables.items():
        for row, expected in zip(rows, old[name], strict=True):
            assert row.keys() == expected.keys()
            for key, value in expected.items():
                near = pytest.approx(value, rel=1e-4, abs=1e-9) if isinstance(value, float) else value
                assert row[key] == near, f"{name}: {key} of {expected}"
