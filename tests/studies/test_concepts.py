"""`python -m studies concepts`."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from acausal import replace
from studies.__main__ import main
from studies.actuators import STROKE, WORN_LOAD
from studies.concepts import CONCEPTS, MOTORS
from studies.concepts._plot import plot_designs
from studies.concepts._rows import Row, optimum, statements
from studies.concepts._targets import OVERALL, opening

EMA, EHS, EHS_VALVE = CONCEPTS


@pytest.mark.thorough
def test_optimum_of_a_pump_beside_a_search_without_gradients() -> None:
    """No displacement of a fine grid opens sooner, and the multiplier of the voltage is the slope of the optimum."""
    motor = MOTORS[2]
    found = EHS_VALVE.solve(motor)
    assert found.status == "optimal"
    assert found.kkt_residual < 1e-8
    best = float(found.values["pump.displacement"])
    assert float(found.model.clutch.rate) * STROKE == pytest.approx(WORN_LOAD)

    def time(**changes: float) -> float:
        values = {"pump.displacement": best, "slave.bore": 22e-3, **changes}
        return float(opening(replace(EHS_VALVE.of(motor), {k.replace("_", "."): v for k, v in values.items()})).t1)

    times = [time(**{"pump.displacement": factor * best}) for factor in np.linspace(0.8, 1.2, 9)]
    assert int(np.argmin(times)) == 4
    assert times[4] == pytest.approx(found.objective, rel=1e-8)
    # By the envelope theorem.
    slope = (time(**{"supply.V": 13.5 - 1e-3}) - time(**{"supply.V": 13.5 + 1e-3})) / 2e-3
    assert found.multipliers["supply.V"] == pytest.approx(slope, rel=1e-4)
    row = optimum(EHS_VALVE, motor, found)
    assert row.mass == pytest.approx(1.8)
    assert row.holding_energy == pytest.approx(10.0 * 13.5**2 / (12.0 / 1.62))


def times_of(fronts: list[dict[str, Any]], product: dict[str, Any]) -> float:
    """A lower bound: the opening time of the next point of the front with more energy than a product."""
    own = [row for row in fronts if (row["design"], row["motor"]) == ("EHS, motor holds, front", product["motor"])]
    return max(row["opening_time"] for row in own if row["holding_energy"] >= product["holding_energy"])


def test_names_in_the_picture_do_not_overlap() -> None:
    """Including those of a dense front."""
    plt = pytest.importorskip("matplotlib.pyplot")
    rows = [
        Row("EMA", f"RE {i}", 0.1 + 0.01 * i, None, 9.0, None, 300.0 - 20.0 * i, None) for i in range(8)
    ] + [Row("EHS, motor holds", "RE 50", 0.5, None, 9.0, None, 2000.0, 2.13)]  # fmt: skip
    (ax,) = plot_designs(rows, [], rows[-1:]).axes
    boxes = [text.get_window_extent() for text in ax.texts]
    assert len(boxes) > len(rows)
    assert all(box.x0 > ax.bbox.x0 and box.count_overlaps(boxes) == 1 for box in boxes)  # each with itself
    plt.close("all")


@pytest.mark.slow
def test_rows_and_report(tmp_path: Path) -> None:
    main(["concepts", "--json", str(tmp_path / "rows.json"), "--out", str(tmp_path)])
    written = json.loads((tmp_path / "rows.json").read_text())
    designed = [row for row in written["rows"] if row["status"]]
    assert all(row["status"] == "optimal" and row["kkt_residual"] < 1e-8 for row in designed)
    # The actuator whose motor need not hold is the fastest.
    times = {(row["design"], row["motor"]): row["opening_time"] for row in designed}
    assert times["EHS, valve holds", "RE 50"] <= times["EHS, motor holds", "RE 50"]
    built = {(row["design"], row["motor"]): row for row in written["rows"] if not row["status"]}
    # The optimum within the limits opens sooner than the prototype, which violates only the lift for a worn clutch.
    prototype = built[f"EMA of 2012, {WORN_LOAD:g} N", "RE 50"]
    assert prototype["holding_current"] < 20.0
    assert times["EMA", "RE 50"] < prototype["opening_time"]
    for one in written["distances"]:
        assert one["best_holding_energy"] < one["holding_energy"]
    # Along a front, time decreases as energy increases; no product is better than the front of its motor.
    for design, motor in {(row["design"], row["motor"]) for row in written["fronts"]}:
        front = [row for row in written["fronts"] if (row["design"], row["motor"]) == (design, motor)]
        times, energies = ([row[name] for row in front] for name in ("opening_time", "holding_energy"))
        assert np.all(np.diff(times) > 0.0)
        assert np.all(np.diff(energies) < 0.0)
        assert times[-1] == pytest.approx(OVERALL)
    bought = [row for row in written["products"] if row["design"] == "product, EHS" and "by motor" in row["remark"]]
    assert bought
    for row in bought:
        assert row["opening_time"] > times_of(written["fronts"], row)
    assert {"concepts.png", "concepts.html"} <= {path.name for path in tmp_path.iterdir()}


@pytest.mark.slow
def test_statements_hold_where_they_are_said_to() -> None:
    found = statements()
    assert found[0].value == pytest.approx(11.0, rel=0.05)
    assert found[1].value < 0.6 * found[1].thesis
    assert found[3].value == pytest.approx(4.0, rel=0.1)
    assert found[4].value < 0.8 * found[4].thesis
