"""`python -m studies`."""

import builtins
import importlib.util
from pathlib import Path
from typing import Any

import pytest

import components
from studies.__main__ import main
from studies._output import finished, print_table, resumed

STUDIES = (
    "validate",
    "optimise",
    "design",
    "concepts",
    "beyond",
    "catalogue",
    "identify",
    "tolerance",
    "control",
    "hold",
    "architectures",
    "prototypes",
)


def test_help(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--help"])
    assert ended.value.code == 0
    text = capsys.readouterr().out
    assert "validate" in text
    assert "optimise" in text
    assert "design" in text
    assert "hold" in text


@pytest.mark.parametrize("study", STUDIES)
def test_help_of_a_study(study: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main([study, "--help"])
    text = capsys.readouterr().out
    assert "--json FILE" in text
    assert "--out DIR" in text


@pytest.mark.parametrize("study", STUDIES)
def test_pictures_without_matplotlib(study: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(SystemExit, match=r"acausal\[plots\]"):
        main([study, "--out", str(tmp_path)])


def test_table_without_rich(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    original = builtins.__import__

    def without_rich(name: str, *arguments: Any) -> Any:
        if name.startswith("rich"):
            raise ImportError
        return original(name, *arguments)

    monkeypatch.setattr(builtins, "__import__", without_rich)
    print_table("Title", ("a", "bb"), [("1", "2")])
    assert capsys.readouterr().out == "Title\na  bb\n1  2\n\n"


def test_what_an_interrupted_study_has_finished_is_not_done_again(tmp_path: Path) -> None:
    made: list[float] = []

    def make() -> list[float]:
        made.append(1.0)
        return made

    assert resumed(tmp_path, "first", make) == resumed(tmp_path, "first", make) == [1.0]
    assert len(made) == 1
    finished(tmp_path)
    assert not list(tmp_path.iterdir())
    resumed(tmp_path, "first", make)
    assert resumed(None, "first", make) == [1.0, 1.0, 1.0]


def test_what_was_made_with_another_library_is_made_anew(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    package = tmp_path / "components"
    package.mkdir()
    monkeypatch.setattr(components, "__file__", str(package / "__init__.py"))
    assert resumed(tmp_path / "out", "first", lambda: 1.0) == 1.0
    assert resumed(tmp_path / "out", "first", lambda: 2.0) == 1.0
    (package / "motors.csv").write_text("resistance\n0.4\n")
    assert resumed(tmp_path / "out", "first", lambda: 2.0) == 2.0
