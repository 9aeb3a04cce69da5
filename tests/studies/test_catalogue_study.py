"""`python -m studies catalogue`."""

import json
from pathlib import Path

import numpy as np
import pytest

from acausal import replace, simulate
from studies.__main__ import main
from studies.actuators import STROKE, ema_maxon
from studies.catalogue import LEADS, LONGEST, TABLES, study


@pytest.mark.slow
def test_rows_and_what_an_interruption_leaves(tmp_path: Path) -> None:
    """A separate run confirms the best product; only the continuous optimum is better, and no feasible product."""
    main(["catalogue", "--json", str(tmp_path / "rows.json"), "--out", str(tmp_path)])
    (row,) = json.loads((tmp_path / "rows.json").read_text())["rows"]
    assert row["combinations"] == sum(int(np.prod([len(t) for t in tables.values()])) for tables in TABLES.values())
    assert row["combinations"] >= 10_000
    assert 0 < row["feasible"] < row["combinations"]
    best, optimum = row["best"], row["continuous_optimum"]
    assert optimum["opening time"] < best["opening time"]
    assert optimum["kkt_residual"] <= 1e-6
    parts = {
        path: value
        for title, rows in TABLES["cam"].items()
        for part in rows
        if part["name"] == best[title]
        for path, value in part.items()
        if path not in ("name", "figures")
    }
    assert parts["motor.resistor.R"] > LEADS
    alone = simulate(replace(ema_maxon(), parts), LONGEST, until=lambda s: s.slave.rod.s - STROKE, rtol=1e-10)
    assert best["opening time"] == pytest.approx(float(alone.t1), rel=1e-6)
    written = {path.name for path in tmp_path.iterdir()}
    assert {"catalogue.png", "catalogue_limits.png", "catalogue.html"} <= written
    # The store is complete: nothing is run again.
    again = study(store=tmp_path / "catalogue")
    assert int(np.sum(again.is_feasible)) == row["feasible"]
    assert again.values[again.order[0], 0] == best["opening time"]
