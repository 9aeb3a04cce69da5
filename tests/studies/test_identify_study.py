"""`python -m studies identify`."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from acausal import parameters
from acausal.design import Experiment, identify
from studies.__main__ import main
from studies.identify import FREE, NOISE, START, TIMES, TRUE, measured

# Results of a collocation method (Radau IIA, five stages) with its own least squares, for the same noise.
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


@pytest.mark.thorough
def test_rows(rows: list[dict[str, Any]]) -> None:
    assert [tuple(row) for row in rows] == [("case", "parameter", "unit", "true", "estimate", "low", "high")] * 9
    for row in rows:
        assert row["low"] < row["estimate"] < row["high"]
        if row["case"] == "exact data":
            assert row["estimate"] == pytest.approx(row["true"], rel=1e-8)


@pytest.mark.thorough
def test_estimates_agree_with_those_of_an_independent_program(rows: list[dict[str, Any]]) -> None:
    noisy = {row["parameter"]: row for row in rows if row["case"] == "noise given"}
    for name, (estimate, std) in ESTIMATES.items():
        assert noisy[name]["estimate"] == pytest.approx(estimate, rel=1e-7)
        assert noisy[name]["high"] - noisy[name]["low"] == pytest.approx(2 * 1.959963984540054 * std, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("stated", [True, False], ids=["noise given", "noise estimated"])
def test_intervals_hold_at_their_rate(stated: bool) -> None:
    """The coverage of the 95 % intervals over 200 replications is within the 0.1 % tails of a binomial distribution.

    The estimates scatter about the true values with the stated standard deviations.
    """
    exact, n, true = measured()["exact data"], 200, parameters(TRUE)
    rng, sigma = np.random.default_rng(31), NOISE if stated else {}
    low, high = stats.binom.ppf([0.001, 0.999], n, 0.95)
    deviations, held = [], []
    for _ in range(n):
        noisy = {name: values + NOISE[name] * rng.standard_normal(len(TIMES)) for name, values in exact.items()}
        fit = identify(START, FREE, Experiment.of_run(TIMES, noisy, sigma=sigma, rtol=1e-9))
        values = np.array([float(true[name]) for name in FREE])
        deviations.append((fit.estimates - values) / fit.std)
        held.append((fit.low <= values) & (values <= fit.high))
    assert np.all((low <= np.sum(held, axis=0)) & (np.sum(held, axis=0) <= high))
    assert np.all(np.abs(np.mean(deviations, axis=0)) < 3.3 / np.sqrt(n))
    assert np.all(np.abs(np.std(deviations, axis=0) - 1.0) < 3.3 / np.sqrt(2.0 * n))
