"""Errors of Modelica texts and of the front end."""

import sys
from pathlib import Path

import pytest

from acausal import ModelError
from acausal._jax_settings import programs
from acausal.modelica._errors import ModelicaError
from acausal.modelica._front import session
from acausal.modelica._front.flatten import flat_model


@pytest.fixture(autouse=True)
def no_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(programs, "folder", None)


def test_a_syntax_error_has_a_place(tmp_path: Path) -> None:
    file = tmp_path / "a.mo"
    file.write_text("model A\n  Real x\nequation\n  x = 1;\nend A;\n")
    with pytest.raises(ModelicaError, match=r"a\.mo, line 2, column 8: unexpected `x`"):
        flat_model(file, "A")


def test_a_type_error_has_a_place() -> None:
    with pytest.raises(ModelicaError, match="line 5, column 3: type mismatch: expected `Boolean`, found `Real`"):
        flat_model("model A\n  Real x = 1;\n  Boolean b;\nequation\n  b = x + 1;\nend A;\n", "A")


def test_a_missing_library_is_named() -> None:
    with pytest.raises(ModelicaError, match=r"line 2: there is no class Plant\.Pump.*library Plant by roots=.*none"):
        flat_model("model A\n  Plant.Pump p;\nend A;\n", "A")


def test_a_class_that_a_library_does_not_have_is_named(tmp_path: Path) -> None:
    (tmp_path / "Plant").mkdir()
    (tmp_path / "Plant" / "package.mo").write_text("package Plant\nend Plant;\n")
    with pytest.raises(ModelicaError, match=r"there is no class Plant\.Pump.*these are .*"):
        flat_model("model A\n  Plant.Pump p;\nend A;\n", "A", [tmp_path])


def test_an_unknown_variable_is_named() -> None:
    with pytest.raises(ModelicaError, match="line 4: there is no variable y"):
        flat_model("model A\n  Real x;\nequation\n  x = y;\nend A;\n", "A")


def test_an_unknown_modifier_is_named() -> None:
    text = "model A\n  parameter Real kv[2](each min = 0) = {1, 2};\nend A;\n"
    flat_model(text, "A(kv(each min = -1) = {1, 3})")
    with pytest.raises(ModelicaError, match=r"A has no k to modify\. Did you mean kv\?"):
        flat_model(text, "A(kv = {1, 2}, final k(min = 3) = max(1, 2))")


def test_a_type_error_in_a_library_names_its_own_file(tmp_path: Path) -> None:
    (tmp_path / "Plant").mkdir()
    (tmp_path / "Plant" / "package.mo").write_text("package Plant\nend Plant;\n")
    file = tmp_path / "Plant" / "Pump.mo"
    file.write_text("within Plant;\nmodel Pump\n  model Part\n  end Part;\n  Part p(k = 2);\nend Pump;\n")
    with pytest.raises(ModelicaError) as found:
        flat_model("", "Plant.Pump", [tmp_path])
    assert str(found.value).startswith(f"{file}, line 5, column 10: unknown modifier `k`")


def test_an_unknown_model_is_named_with_similar_ones() -> None:
    with pytest.raises(ModelicaError, match=r"no model Pumpe in the text\. Did you mean Pump\?"):
        flat_model("model Pump\n  Real x = 1;\nend Pump;\n", "Pumpe")
    with pytest.raises(ModelicaError, match=r"no model Plant\.Pump in the roots\. Give its full name"):
        flat_model("", "Plant.Pump")


def test_other_refusals_name_the_model() -> None:
    with pytest.raises(ModelicaError, match=r"The front end refuses A: .*inner declarations: q"):
        flat_model("model A\n  outer Real q;\n  Real x = q;\nend A;\n", "A")


@pytest.mark.parametrize(
    ("reset", "tie", "error"),
    [
        ("Phi", "Phi = phi", r"line 6: part\.Phi is not a state.*It equals part\.phi: .*reinit\(phi, \.\.\.\)"),
        ("Phi", "-phi = Phi", r"line 6: part\.Phi is not a state.*It equals -part\.phi: .*reinit\(phi, -\.\.\.\)"),
        ("Phi", "Phi = 2 * phi", r"A: part\.Phi is not a state.*Set a variable whose derivative"),
        ("k", "Phi = phi", r"A: part\.k is not a state.*Set a variable whose derivative"),
    ],
)
def test_a_reinit_of_a_variable_that_is_no_state_names_the_state(reset: str, tie: str, error: str) -> None:
    part = f"""model Part
  parameter Real k = 2;
  Real phi(start = 1), Phi;
equation
  der(phi) = -k * phi;
  {tie};
  when phi < 0.5 then
    reinit({reset}, 1);
  end when;
end Part;
"""
    with pytest.raises(ModelicaError, match=error):
        flat_model(f"{part}model A\n  Part part;\nend A;\n", "A")


def test_a_missing_file_and_a_missing_root_are_named() -> None:
    with pytest.raises(ModelicaError, match=r"The file nowhere\.mo does not exist"):
        flat_model("nowhere.mo", "A")
    with pytest.raises(ModelicaError, match="The root nowhere does not exist"):
        flat_model("model A end A;", "A", ["nowhere"])


def test_two_libraries_of_a_name_are_refused(tmp_path: Path) -> None:
    for name in ("one", "two"):
        (tmp_path / name / "Plant").mkdir(parents=True)
        (tmp_path / name / "Plant" / "package.mo").write_text("package Plant\nend Plant;\n")
    with pytest.raises(ModelicaError, match="two libraries Plant"):
        flat_model("", "Plant.A", [tmp_path / "one", tmp_path / "two"])


def test_another_version_of_the_front_end_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session.rumoca(), "version", lambda: "0.9.13")
    with pytest.raises(ModelicaError, match=r"rumoca 0\.9\.13 is installed.*pip install"):
        flat_model("model A end A;", "A")


def test_a_missing_front_end_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rumoca", None)
    with pytest.raises(ModelError, match=r"Modelica needs rumoca: pip install .*modelica"):
        flat_model("model A end A;", "A")
