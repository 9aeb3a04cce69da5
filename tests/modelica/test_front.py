"""The front end of Modelica models: flat models, their places in the text, and what is hidden from the last pass."""

from pathlib import Path

import pytest

from acausal._jax_settings import programs
from acausal.modelica._front import equations, flatten, session
from acausal.modelica._front.flatten import flat_model
from acausal.modelica._front.functions import hidden, restored
from acausal.modelica._front.request import NAME, WRAPPER
from acausal.modelica._front.view import view

MASS = (
    "model Mass\n  parameter Real m = 1;\n  Real v(start = 2, fixed = true);\nequation\n  m*der(v) = -v;\nend Mass;\n"
)


@pytest.fixture(autouse=True)
def no_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(programs, "folder", None)


@pytest.fixture
def library(tmp_path: Path) -> Path:
    folder = tmp_path / "roots" / "Plant"
    folder.mkdir(parents=True)
    (folder / "package.mo").write_text("package Plant\nend Plant;\n")
    (folder / "Pump.mo").write_text(
        "within Plant;\nmodel Pump\n  parameter Real k = 1;\n  Real q;\nequation\n  q = k*time;\nend Pump;\n"
    )
    return folder.parent


def test_a_text_has_a_flat_model_with_places() -> None:
    content, sources = flat_model(MASS, "Mass")
    assert set(content["variables"]) == {"m", "v"}
    span = content["equations"][0]["span"]
    assert sources.place(span["source"], span["start"]) == (NAME, 5)
    assert sources.place(0, 0) is None


def test_modifiers_follow_the_name() -> None:
    content, _ = flat_model(MASS, "Mass(m = 3)")
    assert content["variables"]["m"]["binding"]["Literal"]["value"] == {"Integer": 3}


def test_a_file_has_a_flat_model(tmp_path: Path) -> None:
    file = tmp_path / "mass.mo"
    file.write_text(MASS)
    content, sources = flat_model(file, "Mass")
    span = content["equations"][0]["span"]
    assert sources.place(span["source"], span["start"]) == (str(file), 5)


def test_models_of_a_library_are_found_in_the_roots_and_in_its_own_files(library: Path) -> None:
    whole = flat_model("", "Plant.Pump", [library])
    assert set(flat_model("", "Plant.Pump", [library / "Plant"])[0]["variables"]) == {"k", "q"}
    for source in (library / "Plant", library / "Plant" / "package.mo", library / "Plant" / "Pump.mo"):
        assert set(flat_model(source, "Plant.Pump")[0]["variables"]) == {"k", "q"}
    span = whole[0]["equations"][0]["span"]
    assert whole[1].place(span["source"], span["start"]) == (str(library / "Plant" / "Pump.mo"), 6)


def test_a_text_may_use_a_library(library: Path) -> None:
    content, _ = flat_model("model Two\n Plant.Pump a, b(k = 2);\nend Two;", "Two", [library])
    assert set(content["variables"]) == {"a.k", "a.q", "b.k", "b.q"}


def test_the_flat_model_is_kept_until_a_library_changes(
    library: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(programs, "folder", tmp_path)
    made = []
    original = flatten._flat
    monkeypatch.setattr(flatten, "_flat", lambda what: made.append(what) or original(what))
    first = flat_model("", "Plant.Pump", [library])[0]
    assert flat_model("", "Plant.Pump", [library])[0] == first
    assert len(made) == 1
    pump = library / "Plant" / "Pump.mo"
    pump.write_text(pump.read_text().replace("k*time", "k*time + 1"))
    session._ended()
    assert flat_model("", "Plant.Pump", [library])[0]["equations"] != first["equations"]
    assert len(made) == 2


def test_a_library_that_changes_is_read_again(library: Path) -> None:
    first = flat_model("", "Plant.Pump", [library])[0]
    pump = library / "Plant" / "Pump.mo"
    pump.write_text(pump.read_text().replace("k*time", "k*time + 1"))
    assert flat_model("", "Plant.Pump", [library])[0]["equations"] != first["equations"]


REFUSED = """
package Functions
  function first "The first index of a true element; 0 if there is none."
    input Boolean b[:];
    output Integer i;
  algorithm
    i := 0;
    for k in 1:size(b, 1) loop
      if b[k] then
        i := k;
        return;
      end if;
    end for;
    annotation (Inline = false);
  end first;
end Functions;
model Uses
  Integer i = Functions.first({false, true});
end Uses;
"""


def test_the_body_of_a_hidden_function_is_in_the_flat_model() -> None:
    changed = hidden(REFUSED, ["first"], "here")
    text = f"{changed}\npartial model {WRAPPER} extends Uses; end {WRAPPER};"
    loaded = session.rumoca().Session().loads(text, model=WRAPPER, filename=NAME)
    functions = restored(loaded.to_dict("flat"))["functions"]
    assert set(functions) == {"Functions.first"}
    assert [list(statement) for statement in functions["Functions.first"]["body"]] == [["Assignment"], ["For"]]


def test_a_body_that_is_not_hidden_is_refused() -> None:
    """When the front end accepts it, nothing needs to be hidden any more."""
    with pytest.raises(session.rumoca().CompileError, match="return"):
        session.rumoca().Session().loads(REFUSED, model="Uses", filename=NAME)


def test_a_view_holds_changed_copies_and_links(library: Path) -> None:
    plant = library / "Plant"
    (plant / "Resources").mkdir()
    (plant / "Resources" / "table.txt").write_text("1 2")
    shown = view([library], "equations") / "Plant"
    assert "ndims({q, k*time})" in (shown / "Pump.mo").read_text()
    assert (view([library], "") / "Plant" / "Pump.mo").read_text() == (plant / "Pump.mo").read_text()
    assert (shown / "Resources").is_symlink()
    (plant / "Pump.mo").unlink()
    view([library], "equations")
    assert not (shown / "Pump.mo").exists()
    assert (plant / "Resources" / "table.txt").exists()


COMPLEX = """operator record Complex
  Real re;
  Real im;
  encapsulated operator function '+'
    import Complex;
    input Complex a;
    input Complex b;
    output Complex c;
  algorithm
    c := Complex(a.re + b.re, a.im + b.im);
  end '+';
end Complex;
model Sum
  Complex a;
  Complex b[2];
  Real x[3](each start = 1);
  discrete Integer n(start = 0);
equation
  a + b[1] = Complex(1, // the real part
    time) "a note; with = and {";
  for i in 1:2 loop
    b[i] = a + Complex(i, 0);
  end for;
  if time > 1 then
    der(x) = -x;
  else
    der(x) = {1, 2, 3};
  end if;
  when sample(0, 1) then
    n = pre(n) + 1;
  end when;
end Sum;
"""


def test_equations_that_the_last_pass_refuses_are_hidden_and_shown_again() -> None:
    with pytest.raises(session.rumoca().CompileError, match="todae"):
        session.rumoca().Session().loads(COMPLEX, model="Sum", filename=NAME)
    content, sources = flat_model(COMPLEX, "Sum")
    assert set(content["variables"]) == {"a.re", "a.im", "b[1].re", "b[1].im", "b[2].re", "b[2].im", "x", "n"}
    first = content["equations"][0]["residual"]["Binary"]
    assert (first["op"], list(first["lhs"]), list(first["rhs"])) == ("Sub", ["Binary"], ["FunctionCall"])
    spans = [equation["span"] for equation in content["equations"]]
    assert [sources.place(span["source"], span["start"]) for span in spans] == [(NAME, n) for n in (19, 21, 21, 24)]
    assert equations.NEVER not in str(content)
    assert len(content["equations"]) == 4
    assert len(content["when_chains"]) == 1


def test_hidden_equations_keep_their_lines() -> None:
    changed = equations.hidden(COMPLEX, "here")
    assert changed.count("\n") == COMPLEX.count("\n")
    assert "n = pre(n) + 1;" in changed.splitlines()[29]
    assert '"a note; with = and {"' in changed


def test_bindings_of_models_with_complex_numbers_become_equations() -> None:
    text = "model M\n  record R\n    Real a = b;\n  end R;\n  Complex z = w * 2;\nend M;\n"
    changed = equations.hidden(text, "here")
    assert "Complex z ;" in changed
    assert "ndims({z, w * 2})" in changed
    assert "Real a = b;" in changed
