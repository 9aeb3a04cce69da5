"""Errors of Modelica texts: each with its file, line and column, and the text above a caret."""

import re
from pathlib import Path

import numpy as np
import pytest

from acausal import ModelError, ParameterError, SimulationError, StructureError, replace, simulate, structure
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


BODY = "Real x(start = 1, fixed = true); equation der(x) = -k * x;"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (f"model M parameter Real k(min = 0, max = 1) = 2; {BODY} end M;", "k must be between 0 and 1"),
        (f"model M parameter Real k(min = 1); {BODY} end M;", "k must be at least 1"),
        (f"model M parameter Integer k(max = 3) = 4; {BODY} end M;", "k must be at most 3"),
        (f"model M parameter Real l = 3; parameter Real k(min = l) = l / 2; {BODY} end M;", "k must be at least 3"),
        (f"model M type K = Real(min = 0); parameter K k = -1; {BODY} end M;", "k must be at least 0"),
        (f"model M type E = enumeration(a, b); parameter E e(min = E.b) = E.a; parameter Real k = 1; {BODY} end M;",
         "e must be at least 2"),
        (f"model A parameter Real k(min = 0); {BODY} end A; model M parameter Real q; A a[2](k = {{q, q - 1}}); end M;",
         r"a\[2\]\.k must be at least 0"),
        (f"model M parameter Real a[2](max = {{1, 5}}) = {{2, 2}}, k = a[1]; {BODY} end M;", "a must be"),
        (f"model M parameter Real k(min = 0, max = 1) = 1; {BODY} end M;", ""),
        (f"model M parameter Real k(min = 0, fixed = false); {BODY} initial equation k = -1; end M;", ""),
    ],
)  # fmt: skip
def test_parameters_outside_their_limits_are_refused_with_their_place(text: str, message: str) -> None:
    if not message:
        load(text, "M")
        return
    with pytest.raises(ModelicaError, match=rf"^<model>\.mo:1: {message}.*declared in <model>\.mo:1\), got"):
        load(text, "M")


def test_a_modifier_widens_the_limits_of_a_parameter() -> None:
    text = f"model A type K = Real(min = 1); parameter K k = 0; {BODY} end A; model M A a[2]; end M;"
    with pytest.raises(ModelicaError, match=r"Remedy: another value, or another limit by a modifier: k\(min="):
        load(text, "M")
    load(text, "M(a(each k(min=0)))")


def test_parameters_that_move_out_of_their_limits_end_the_run() -> None:
    text = f"model A parameter Real k(max = 10); {BODY} end A; model M parameter Real q = 2; A a(k = 4 * q); end M;"
    model = replace(load(text, "M"), {"q": 3.0})
    with pytest.raises(ParameterError, match=r"a\.k must be at most 10 \(declared in <model>\.mo:1\), got 12"):
        simulate(model, 0.1)
    model = load(f"model M parameter Real k(min = -1) = 0; {BODY} end M;", "M")
    with pytest.raises(ParameterError, match=r"k must be at least -1 \(declared in <model>\.mo:1\), got -2"):
        replace(model, {"k": -2.0})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("  Real x, y;\nequation\n  x + y = 1;", r"variables: x \(<model>\.mo:2\), y \(<model>\.mo:2\)"),
        ("  Real x;\nequation\n  x = 1;\n  x = 2;", r"equations: <model>\.mo:4, <model>\.mo:5\n  variables: x \(<m"),
        (
            "  parameter Real k = 0;\nequation\n  k = 2;",
            r"Too many equations: <model>\.mo:4 has no variable to determine",
        ),
        ("  Real x[3];\nequation\n  x[1:2] = {1, 2};", r"no equation determines x\[3\] \(<model>\.mo:2\)"),
        ("  Real x[2,3];\nequation\n  x[1,:] = {1, 2, 3}; x[2,1:2] = {1, 2};", r"no equation determines x\[2,3\] \("),
        ("  Real x[2];\nequation\n  x = {1, 2};\n  x[2] = 1;", r"equations: <model>\.mo:4\[2\], <model>\.mo:5"),
        ("  connector C\n    Real e;\n  end C;\n  C c[2];\nequation\n  c[1].e = 1;", r"c\[2\]\.e \(<model>\.mo:3\)"),
    ],
)
def test_errors_of_the_structure_name_the_lines_of_variables(text: str, message: str) -> None:
    with pytest.raises(StructureError, match=message):
        simulate(load(f"model M\n{text}\nend M;", "M"), 1.0)


@pytest.mark.parametrize(
    "text",
    [
        "Boolean a; equation a = not a;",
        "Boolean a, b; equation a = not b; b = a;",
        "Boolean a; Real x(start = 0, fixed = true); equation a = (if a then x > 0.5 else x < 0.3); der(x) = 1;",
    ],
)
@pytest.mark.thorough
def test_a_loop_of_truths_without_a_solution_is_refused(text: str) -> None:
    with pytest.raises(SimulationError, match=r"The equations <model>\.mo:1.* have no solution there"):
        simulate(load(f"model M {text} end M;", "M"), 1.0)


@pytest.mark.thorough
def test_a_loop_of_truths_with_a_solution_is_solved() -> None:
    text = "model M Boolean a, b; equation a = not b; b = a and time > 0.5; end M;"
    solution = simulate(load(text, "M"), 0.4)
    assert solution["a"][-1] == 1.0
    assert solution["b"][-1] == 0.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('when x > 1 then terminate("x is above one"); end when;', r"terminate \(a\.<model>\.mo:1\): x is above one"),
        ('algorithm when x > 1 then terminate("it ends"); end when;', r"terminate \(a\.<model>\.mo:1\): it ends"),
        ('when x > 1 then terminate("x is " + String(x) + " m"); end when;', r"terminate \(.*: x is \.\.\. m"),
        ('assert(x < 1, "x is above one");', r"assert \(a\.<model>\.mo:1\): x is above one"),
    ],
)
def test_what_ends_a_run_has_its_place_and_message(text: str, message: str) -> None:
    source = f"model A Real x(start = 0, fixed = true); equation der(x) = 1; {text} end A; model M A a; end M;"
    with pytest.raises(SimulationError, match=f"At t = 1 s: {message}"):
        simulate(load(source, "M"), 2.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('Integer i = 1; Real y = if String(i) == "1" then 1 else 0;', ":1: a text that depends on variables is not"),
        ('Boolean b = time > 0.5; Real y = if (if b then "x" else "y") == "x" then 1 else 0;', ":1: a text that dep"),
        ('String s; Real y = if s == "a" then 1 else 0; equation s = "a";', "mo:1, M: the value of s is not known"),
        ('String s; Real y = if s == "a" then 1 else 0; algorithm s := "a";', "mo:1, M: the value of s is not known"),
    ],
)
def test_relations_of_texts_that_may_vary_are_refused(text: str, message: str) -> None:
    with pytest.raises(ModelicaError, match=message):
        simulate(load(f"model M {text} end M;", "M"), 1.0)


def test_assertions_hold_at_the_start_for_the_values_of_if_expressions_there() -> None:
    text = 'Real y = 3; Real x = if y > 0 then 1 else 5; equation assert(x < 3, "too large");'
    assert simulate(load(f"model M {text} end M;", "M"), 1.0, save="end").final.x == 1.0


def test_names_of_elements_count_from_1_and_can_be_read() -> None:
    text = "model M Real x[1,2](each start = 1, each fixed = true); equation EQUATIONS end M;"
    for equations in ("der(x) = {{1, 2}};", "der(x[1,1]) = 1; der(x[1,2]) = 2;"):
        solution = simulate(load(text.replace("EQUATIONS", equations), "M"), 1.0, save="end")
        assert solution["x[1,2]"][-1] == pytest.approx(3.0)
        assert solution["x"].shape == (len(solution.ts), 1, 2)
        assert "x[1,3]" not in solution
        assert {"x[1,1]", "x[1,2]"} <= set(solution.to_pandas().columns)


def test_inputs_without_a_connection_are_named_as_such() -> None:
    text = """
package P
  connector In = input Real;
  connector Out = output Real;
  block Gain
    In u;
    Out y = 2 * u;
  end Gain;
  model M
    Gain free, next, bound(u = 3), stated;
  equation
    connect(free.y, next.u);
    stated.u = 4;
  end M;
end P;"""
    with pytest.raises(StructureError) as raised:
        structure(load(text, "P.M"))
    assert re.findall(r"(\S+) \(an input without a connection, <model>.mo:6\)", str(raised.value)) == ["free.u"]


@pytest.mark.parametrize(("one", "other"), [("p", "'p'"), ("lambda", "lambda_"), ("'a+b'", "'a-b'")])
def test_names_that_are_equal_as_attributes_are_refused(one: str, other: str) -> None:
    text = f"model M\n  parameter Real {one} = 1;\n  parameter Real {other} = 2;\nend M;"
    with pytest.raises(ModelicaError, match=rf"{re.escape(one)} and {re.escape(other)} would both be the attribute"):
        load(text, "M")
