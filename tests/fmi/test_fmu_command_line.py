"""The command line of FMUs."""

import csv
from pathlib import Path

import pytest

from acausal.fmi.__main__ import main

pytest.importorskip("fmpy")

EXPORT = ["export", "_fmu_models:Forced", "--inputs", "u", "--outputs", "x", "power.value"]


@pytest.fixture(scope="module")
def forced(tmp_path_factory: pytest.TempPathFactory) -> str:
    file = str(tmp_path_factory.mktemp("fmu") / "new" / "forced.fmu")
    assert main([*EXPORT[:2], file, *EXPORT[2:]]) == 0
    return file


def test_check_lists_the_variables(forced: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", forced]) == 0
    words = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["mu", "parameter", "1", "1.0"] in words


def test_simulate_sets_and_shows_variables_by_their_names(
    forced: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With almost no mu and x = v = 0, a force of 3 moves x to 3 (1 - cos t)."""
    table, picture = tmp_path / "run.csv", tmp_path / "run.png"
    settings = ["--set", "mu=1e-9", "x=0", "u=3"]
    assert main(["simulate", forced, "--stop", "2", *settings, "--csv", str(table), "--plot", str(picture)]) == 0
    rows = list(csv.reader(table.read_text().splitlines()))
    assert rows[0] == ["time", "x", "power.value"]
    assert float(rows[-1][1]) == pytest.approx(3.0 * 1.4161468, rel=1e-4)
    assert "power.value" in capsys.readouterr().out
    assert picture.read_bytes()[1:4] == b"PNG"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--set", "mass=2"], "could not be set: mass"),
        (["--set", "mu"], "'mu' is not a setting"),
    ],
)
def test_bad_settings_are_named(
    forced: str, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["simulate", forced, "--stop", "1", *arguments]) == 1
    assert message in capsys.readouterr().err


def test_an_unknown_model_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "_fmu_models:nothing", str(tmp_path / "x.fmu")]) == 1
    assert "names no model" in capsys.readouterr().err
