"""The benchmarks run, and report what they promise."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from benchmarks.__main__ import BENCHMARKS, main
from benchmarks._precision import Curve, best_time
from benchmarks._rows import Row, compared, show


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> dict:
    folder: Path = tmp_path_factory.mktemp("benchmarks")
    main(["--quick", "--only", "chain", "scale", "--json", str(folder / "rows.json"), "--out", str(folder)])
    assert (folder / "chain.png").stat().st_size > 0
    return json.loads((folder / "rows.json").read_text())


@pytest.mark.thorough
def test_rows_have_the_promised_fields(saved: dict) -> None:
    assert saved["rows"]
    for row in saved["rows"]:
        assert list(row) == ["name", "value", "unit", "against", "ratio"]
        assert math.isfinite(row["value"])
        assert row["ratio"] is None or math.isfinite(row["ratio"])


def test_the_page_lists_every_benchmark() -> None:
    page = (Path(__file__).parents[2] / "docs" / "benchmarks.md").read_text()
    assert not [name for name in BENCHMARKS if f"| `{name}` |" not in page]


def test_the_limit_decides_over_the_ratio() -> None:
    assert compared("a", 1.0, "s", 2.0, "b", 0.5).verdict == "met"
    assert compared("a", 1.1, "s", 2.0, "b", 0.5).verdict == "missed"
    assert Row("a", 1.0, "s", "", None).verdict == ""


def test_a_narrow_table_has_whole_numbers(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("FORCE_COLOR", "1")  # rich then writes as to a terminal
    show([compared("a servo of some states, in a second process", 12.345, "s", 6.789, "the same by hand", limit=1.23)])
    printed = capsys.readouterr().out
    assert all(number in printed for number in ("12.35", "1.82", "1.23", "missed"))


def test_times_are_interpolated_in_logarithms() -> None:
    curve = Curve("a", np.array([1e-2, 1e-4, 1e-6]), np.array([1.0, 10.0, 100.0]))
    np.testing.assert_allclose([curve.time_at(error) for error in (1e-2, 1e-3, 1e-6)], [1.0, 10**0.5, 100.0])
    assert math.isnan(curve.time_at(1e-7))
    faster = Curve("b", curve.errors, curve.times / 2)
    assert best_time([curve, faster], 1e-3) == pytest.approx(10**0.5 / 2)


def test_an_accuracy_by_chance_does_not_count() -> None:
    lucky = Curve("a", np.array([1e-2, 1e-9, 1e-6]), np.array([1.0, 2.0, 100.0]))
    assert lucky.time_at(1e-6) == pytest.approx(2.0)
    assert math.isnan(lucky.time_at(1e-8))
