"""Errors of Modelica texts: each with its file, line and column, and the text above a caret."""

from pathlib import Path

import numpy as np
import pytest

from acausal import ModelError, simulate
from acausal._jax_settings import programs
from acausal.modelica import ModelicaError, load


@pytest.fixture(autouse=True)
def no_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(programs, "folder", None)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "model A\n  Real x\nequation\n  x = 1;\nend A;\n",
            "3:1: expected `;` after the declaration, but found `equation`.\n  equation\n  ^",
        ),
        (
            "model A\n  Real x = 1;\n  Boolean b;\nequation\n  b = x + 1;\nend A;\n",
            "5:3: the sides of the equation have different types: Boolean and Real.\n    b = x + 1;\n    ^",
        ),
        (
            "model A\n  Real x;\nequation\n  x = y;\nend A;\n",
            "4:7: there is no variable or class y.\n    x = y;\n        ^",
        ),
        (
            "model A\n  Plant.Pump p;\nend A;\n",
            "2:3: there is no class Plant.Pump. If Plant is a library, give its folder by roots=[...]; none are given."
            "\n    Plant.Pump p;\n    ^",
        ),
    ],
)
def test_an_error_of_the_text_shows_its_place(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ModelicaError) as found:
        load(text, "A")
    assert str(found.value) == f"<model>.mo:{message}"
    file = tmp_path / "a.mo"
    file.write_text(text)
    with pytest.raises(ModelicaError) as found:
        load(file, "A")
    assert str(found.value) == f"{file}:{message}"


def test_an_error_in_a_library_names_its_own_file(tmp_path: Path) -> None:
    (tmp_path / "Plant").mkdir()
    (tmp_path / "Plant" / "package.mo").write_text("package Plant\nend Plant;\n")
    file = tmp_path / "Plant" / "Pump.mo"
    file.write_text("within Plant;\nmodel Pump\n  model Part\n  end Part;\n  Part p(k = 2);\nend Pump;\n")
    with pytest.raises(ModelicaError) as found:
        load("", "Plant.Pump", tmp_path)
    assert str(found.value).startswith(f"{file}:5:10: Part has no element k to modify.")


def test_an_unknown_modifier_is_named() -> None:
    text = "model A\n  parameter Real kv[2](each min = 0) = {1, 2};\nend A;\n"
    load(text, "A(kv(each min = -1) = {1, 3})")
    with pytest.raises(ModelicaError, match=r"the modifiers of A:1:15: A has no element k .* Did you mean kv\?"):
        load(text, "A(kv = {1, 2}, final k(min = 3) = max(1, 2))")


@pytest.mark.parametrize("value", [50_000 * "(" + "1" + 50_000 * ")", 50_000 * "1 + " + "1"])
def test_a_text_that_nests_too_deeply_is_refused(value: str) -> None:
    with pytest.raises(ModelicaError, match="nest too deeply"):
        load(f"model Deep Real x = {value}; end Deep;", "Deep")


RESET = """model A
  parameter Real k = 2;
  Real x(start = 1, fixed = true), y;
equation
  der(x) = -k * x;
  {tie};
  when x < 0.5 then
    reinit({reset}, 1);
  end when;
end A;
"""


@pytest.mark.thorough
@pytest.mark.parametrize(("tie", "sign"), [("y = x", 1.0), ("-x = y", -1.0)])
def test_a_reinit_of_a_variable_that_equals_a_state_sets_the_state(tie: str, sign: float) -> None:
    solution = simulate(load(RESET.format(tie=tie, reset="y"), "A"), 0.5, save="end", rtol=1e-9)
    assert solution["x"][-1] == pytest.approx(sign * 2.0 * np.exp(-1.0), rel=1e-7)


def test_a_reinit_of_a_variable_that_is_no_state_is_refused() -> None:
    with pytest.raises(ModelError, match="y, which is neither a state nor tied to states"):
        simulate(load(RESET.format(tie="y = 2 * x", reset="y"), "A"), 0.5)
    with pytest.raises(ModelicaError, match="mo:8:5: `reinit` needs a continuous Real variable"):
        load(RESET.format(tie="y = x", reset="k"), "A")


def test_a_missing_file_and_a_missing_root_are_named() -> None:
    with pytest.raises(ModelicaError, match=r"The file nowhere\.mo does not exist"):
        load("nowhere.mo", "A")
    with pytest.raises(ModelicaError, match="The root nowhere does not exist"):
        load("model A end A;", "A", ["nowhere"])
