"""The command line."""

import csv
from pathlib import Path
from typing import Any

import pytest

from acausal.modelica import __main__ as command_line
from acausal.modelica._scoreboard.compare import Compared
from acausal.modelica._scoreboard.table import save, saved, written


@pytest.fixture
def references(tmp_path: Path) -> Path:
    for name in ("Good", "Bad"):
        (tmp_path / "M" / name).mkdir(parents=True)
        (tmp_path / "M" / name / "comparisonSignals.txt").write_text("time\nx\n")
    return tmp_path


def test_failed_rows_run_again_on_request(references: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = tmp_path / "rows.jsonl"
    save(Compared("M.Good", "agrees", deviations={"x": 2e-5}), rows)
    save(Compared("M.Bad", "run", "it fails"), rows)
    run: list[str] = []

    class Done:
        stderr = "it fails again"

    def process(command: list[str], **options: Any) -> Done:
        run.append(command[command.index("--one") + 1])
        assert "--roots=libraries" in command
        return Done()

    monkeypatch.setattr(command_line.subprocess, "run", process)
    arguments = ["scoreboard", "--roots", "libraries", "--references", str(references), "--rows", str(rows)]
    assert command_line.main(arguments) == 0
    assert run == []
    assert command_line.main([*arguments, "--again"]) == 0
    assert run == ["M.Bad"]
    assert saved(rows)["M.Bad"].reason == "it fails again"


def test_the_page_lists_models_that_agree() -> None:
    assert "| L.Parts.Good | agrees | 0 | x by 2e-05 of its range |" in written(
        [Compared("L.Parts.Good", "agrees", deviations={"x": 2e-5})], "about"
    )


def test_roots_stand_before_or_after_the_model(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    library = tmp_path / "L.mo"
    library.write_text("package L model M parameter Real k = 2; Real x = k * time; end M; end L;")
    assert command_line.main(["check", "--roots", str(tmp_path), "", "L.M"]) == 0
    assert "k = 2" in capsys.readouterr().out


def test_references_and_models_that_do_not_exist_are_named(
    references: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["scoreboard", "--roots", "libraries", "--references"]
    assert command_line.main([*arguments, str(tmp_path / "M" / "Good"), "--only", "Ugly"]) != 0
    assert "No model with a reference has a name that contains 'Ugly'" in capsys.readouterr().err
    (tmp_path / "empty").mkdir()
    assert command_line.main([*arguments, str(tmp_path / "empty")]) != 0
    assert "has no folder with comparisonSignals.txt" in capsys.readouterr().err


def test_signals_are_written_and_their_elements_count_from_1(tmp_path: Path) -> None:
    (tmp_path / "L.mo").write_text(
        "package L model M Real x[2](each start = 1); equation der(x) = {1, 2}; end M; end L;"
    )
    table = tmp_path / "run.csv"
    arguments = ["simulate", "--roots", str(tmp_path), "", "L.M", "--stop", "1", "--csv", str(table)]
    assert command_line.main(arguments) == 0
    head, *_, last = table.read_text().splitlines()
    assert head == '"time","x[1]","x[2]"'
    assert [float(value) for value in last.split(",")] == pytest.approx([1.0, 2.0, 3.0])


@pytest.mark.parametrize(
    "text",
    [
        "Real x[2](each start = 1, each fixed = true); equation der(x) = {1, 2};",
        "Real x[2](each start = 1, each fixed = true); equation der(x[1]) = 1; der(x[2]) = 2;",
        "model P Real x[2](each start = 1, each fixed = true); equation der(x[1]) = 1; der(x[2]) = 2; end P; P p[2];",
    ],
)
@pytest.mark.thorough
def test_an_element_is_chosen_by_its_modelica_name(tmp_path: Path, text: str) -> None:
    (tmp_path / "L.mo").write_text(f"package L model M {text} end M; end L;")
    table, name = tmp_path / "run.csv", "p[2].x" if "P p" in text else "x"
    arguments = ["simulate", "--roots", str(tmp_path), "", "L.M", "--stop", "1", "--csv", str(table), "--signals"]
    assert command_line.main([*arguments, f"{name}[1]", f"{name}[2]"]) == 0
    head, *_, last = table.read_text().splitlines()
    assert head == f'"time","{name}[1]","{name}[2]"'
    assert [float(value) for value in last.split(",")] == pytest.approx([1.0, 2.0, 3.0])
    assert command_line.main([*arguments, f"{name}[3]"]) != 0
    assert command_line.main([*arguments, f"{name}[0]"]) != 0


@pytest.mark.thorough
def test_states_that_are_elements_of_a_matrix_have_their_modelica_names(tmp_path: Path) -> None:
    text = "Real x[1,2](each start = 1, each fixed = true); equation der(x[1,1]) = 1; der(x[1,2]) = 2;"
    (tmp_path / "L.mo").write_text(f"package L model M {text} end M; end L;")
    for more in ([], ["--signals", "x"], ["--signals", "x[1,1]", "x[1,2]"]):
        table = tmp_path / "run.csv"
        arguments = ["simulate", "--roots", str(tmp_path), "", "L.M", "--stop", "1", "--csv", str(table), *more]
        assert command_line.main(arguments) == 0
        head, *_, last = table.read_text().splitlines()
        found = dict(zip(next(csv.reader([head])), map(float, last.split(",")), strict=True))
        assert found == pytest.approx({"time": 1.0, "x[1,1]": 2.0, "x[1,2]": 3.0})


FALL = """package L
  model Fall
    Real x[2](start = {1, 2}, each fixed = true);
  equation
    der(x) = {3, 4};
    annotation(experiment(StartTime = 1, StopTime = 3));
  end Fall;
  model Endless
    extends Fall;
    annotation(experiment(StopTime = 1e9, Tolerance = 1e-3));
  end Endless;
  model Plain
    Real x(start = 1, fixed = true);
  equation
    der(x) = 1;
  end Plain;
end L;
"""


def test_the_annotation_gives_the_interval(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "L.mo").write_text(FALL)
    table = tmp_path / "run.csv"
    assert command_line.main(["simulate", "--roots", str(tmp_path), "", "L.Fall", "--csv", str(table)]) == 0
    assert "x[2]: 2 to 10" in capsys.readouterr().out
    lines = table.read_text().splitlines()
    assert [float(line.split(",")[0]) for line in (lines[1], lines[-1])] == [1.0, 3.0]
    assert command_line.main(["simulate", "--roots", str(tmp_path), "", "L.Fall", "--stop", "2"]) == 0
    assert "x[2]: 2 to 6" in capsys.readouterr().out
    assert command_line.main(["simulate", "--roots", str(tmp_path), "", "L.Plain"]) != 0
    assert "no annotation experiment(StopTime=...). Remedy: --stop" in capsys.readouterr().err


def test_an_unknown_signal_is_refused_before_the_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "L.mo").write_text(FALL)
    monkeypatch.setattr(command_line, "simulate", None)
    arguments = ["simulate", "--roots", str(tmp_path), "", "L.Fall", "--signals"]
    for name, said in {"xx": "There is no signal 'xx'. Did you mean x?", "x[3]": "x has size [2]"}.items():
        assert command_line.main([*arguments, name]) != 0
        assert said in capsys.readouterr().err


def test_check_shows_names_of_the_text(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = """package L
  model Counter
    Integer n(start = 3, fixed = true);
    Real x(start = 1, fixed = true), y = floor(x);
  equation
    when sample(0, 1) then
      n = pre(n) + 1;
    end when;
    der(x) = -x + delay(x, 0.1);
  end Counter;
  model M
    Counter one, several[2];
  end M;
end L;
"""
    (tmp_path / "L.mo").write_text(text)
    assert command_line.main(["check", "--roots", str(tmp_path), "", "L.M"]) == 0
    found = capsys.readouterr().out
    for shown in ("one: Counter", "several[2]: Counter", "pre(n) = 3", "x      = 1"):
        assert shown in found
    for hidden in ("initial_", "ticks", "Part_", "floor_", "past", "Units not checked"):
        assert hidden not in found
