"""The study of designs: optima with their certificates, rows and report."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

from studies import design
from studies.design import PROBLEMS, Row


def test_problems_have_distinct_names_and_start_within_bounds() -> None:
    assert len({problem.name for problem in PROBLEMS}) == len(PROBLEMS)
    six = PROBLEMS[-1]
    assert (len(six.free), len(six.limits), six.starts) == (6, 6, 10)


@pytest.mark.thorough
def test_rows_and_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    import studies.design._main as main

    monkeypatch.setattr(main, "PROBLEMS", PROBLEMS[2:3])
    rows = design.main(json=tmp_path / "rows.json", out=tmp_path)
    assert all(isinstance(row, Row) for row in rows)
    displacement = 1.25e-6 / (2.0 * math.pi)
    starts = sorted(row.start["pump.displacement"] for row in rows)
    assert starts == pytest.approx([displacement / 3.0, displacement * 3.0])
    for row in rows:
        assert row.variables["pump.displacement"] == pytest.approx(2.554040e-07, rel=1e-6)
        assert row.kkt_residual < 1e-9
        assert row.status == "optimal"
        assert row.simulations > 5
    written: dict[str, Any] = json.loads((tmp_path / "rows.json").read_text())
    assert written["rows"][0]["problem"] == "EHS, RE40: displacement"
    page = (tmp_path / "design.html").read_text()
    assert "KKT residual" in page
    assert "data:image/png;base64," in page
    assert (tmp_path / "design_1.png").stat().st_size > 10_000
    assert "opening time 124.109 ms: optimal" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize("index", [0, 1])
def test_best_ratio_is_found_from_both_sides(index: int) -> None:
    found = PROBLEMS[index].solve()
    for end in (found, *found.others):
        assert end.kkt_residual < 1e-9
        assert end.values["gearbox.ratio"] == pytest.approx(found.values["gearbox.ratio"], rel=1e-7)


@pytest.mark.slow
def test_six_variables_and_six_limits() -> None:
    found = PROBLEMS[-1].solve()
    assert found.status == "optimal"
    assert found.kkt_residual < 1e-7
    assert len(found.others) == 9
