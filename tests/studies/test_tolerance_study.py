"""`python -m studies tolerance`."""

import json
from pathlib import Path

import pytest

from studies.__main__ import main


@pytest.mark.slow
def test_rows(tmp_path: Path) -> None:
    """Against a collocation method (Radau IIA, five stages) with complex-step derivatives."""
    main(["tolerance", "--json", str(tmp_path / "rows.json"), "--out", str(tmp_path)])
    rows = {row["method"]: row for row in json.loads((tmp_path / "rows.json").read_text())["rows"]}
    assert all(tuple(row) == ("result", "method", "mean", "std", "p01", "p99") for row in rows.values())
    assert rows["first order"]["mean"] == pytest.approx(0.08345388161637354, rel=1e-8)
    assert rows["first order"]["std"] == pytest.approx(0.005696868163112444, rel=1e-7)
    assert rows["second order"]["mean"] == pytest.approx(0.08377151747580218, rel=1e-5)
    drawn = rows["Monte Carlo"]
    assert drawn["mean"] == pytest.approx(0.08381860411080783, rel=1e-9)
    assert drawn["std"] == pytest.approx(0.005851403874383361, rel=1e-8)
    assert drawn["p01"] == pytest.approx(0.07182919543115339, rel=1e-8)
    assert drawn["p99"] == pytest.approx(0.09874807819953114, rel=1e-8)
    assert rows["Sobol sequence"]["std"] == pytest.approx(drawn["std"], rel=0.05)
    written = {path.name for path in tmp_path.iterdir()}
    assert {"tolerance.png", "tolerance_causes.png", "tolerance_sensitivities.png", "tolerance.html"} <= written
