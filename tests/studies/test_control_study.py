"""`python -m studies control`."""

import json
from pathlib import Path
from typing import Any

import pytest

from studies.__main__ import main
from studies.control import ACTUATORS, SLOWER, SOFT

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, Any]]:
    folder = tmp_path_factory.mktemp("control")
    main(["control", "--json", str(folder / "rows.json"), "--out", str(folder), "--rtol", "1e-8"])
    ways = {f"control_{name}_{way}" for name in ACTUATORS for way in ("soonest", "least_heat")}
    assert {path.stem for path in Path(folder).glob("*.png")} == ways
    assert (folder / "control.html").read_text().count("data:image/png") == len(ways)
    return json.loads((folder / "rows.json").read_text())["rows"]


def test_rows_hold_what_was_asked_for(rows: list[dict[str, Any]]) -> None:
    for full, soonest, coolest, (_, allowed) in zip(rows[::3], rows[1::3], rows[2::3], ACTUATORS.values(), strict=True):
        assert full["time"] == full["full_voltage_time"]
        assert full["peak_current"] > allowed
        # Full voltage opens soonest of all.
        assert full["time"] < soonest["time"] < coolest["time"]
        assert coolest["time"] == pytest.approx(SLOWER * full["time"], rel=1e-9)
        assert coolest["heat"] < soonest["heat"]
        for row in (soonest, coolest):
            assert row["full_voltage_time"] == full["time"]
            # Second derivatives need not prove that a stationary signal has the least heat.
            assert row["status"] in ({"optimal"} if row is soonest else {"optimal", "stationary"})
            assert row["kkt_residual"] < 1e-6
            assert row["end_speed"] <= SOFT * (1.0 + 1e-6) < full["end_speed"]
            assert row["peak_current"] <= allowed * (1.0 + 1e-6)
