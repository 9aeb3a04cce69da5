"""`python -m studies identify`."""

import json
from pathlib import Path
from typing import Any

import pytest

from studies.__main__ import main

# Of a collocation method (Radau IIA, five stages) with its own least squares, for the same noise.
ESTIMATES = {
    "motor.resistor.R": (0.30990530849646286, 0.0008856639043237525),
    "motor.bearing.C": (0.003972211282953392, 2.5409609296703217e-05),
    "motor.emf.k": (0.03838782753146838, 0.00014786433366079923),
}


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, Any]]:
    folder = tmp_path_factory.mktemp("identify")
    main(["identify", "--json", str(folder / "rows.json"), "--out", str(folder)])
    assert _written(folder) == {"identify", "identify_residuals", "identify_correlation", "identify_profile"}
    assert "data:image/png" in (folder / "identify.html").read_text()
    return json.loads((folder / "rows.json").read_text())["rows"]


def _written(folder: Path) -> set[str]:
    return {path.stem for path in folder.glob("*.png")}


def test_rows(rows: list[dict[str, Any]]) -> None:
    assert [tuple(row) for row in rows] == [("case", "parameter", "unit", "true", "estimate", "low", "high")] * 9
    for row in rows:
        assert row["low"] < row["estimate"] < row["high"]
        if row["case"] == "exact data":
            assert row["estimate"] == pytest.approx(row["true"], rel=1e-8)


def test_estimates_agree_with_those_of_an_independent_program(rows: list[dict[str, Any]]) -> None:
    noisy = {row["parameter"]: row for row in rows if row["case"] == "noise given"}
    for name, (estimate, std) in ESTIMATES.items():
        assert noisy[name]["estimate"] == pytest.approx(estimate, rel=1e-7)
        assert noisy[name]["high"] - noisy[name]["low"] == pytest.approx(2 * 1.959963984540054 * std, rel=1e-6)
