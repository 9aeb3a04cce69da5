"""Redeclarations and modifiers of classes (Modelica 3.6, section 7.3), by the values of variables."""

import re

import pytest

from acausal import simulate
from acausal.modelica import load

pytestmark = pytest.mark.thorough  # they compile a program each; test_modelica_modification.py looks at flat models

TEXT = """
package K
  model Base parameter Real k = 1; Real y; end Base;
  model Single extends Base; equation y = k; end Single;
  model Twice extends Base; equation y = 2 * k; end Twice;
  record Row parameter Real a = 1; end Row;
  package M
    constant Real c = 3;
    constant Real d = 2 * c;
    replaceable function f input Real x; output Real y; algorithm y := 2 * x; end f;
    function g input Real x; output Real y; algorithm y := f(x) * c; end g;
  end M;
  function h input Real x; output Real y; algorithm y := 3 * x; end h;
  model B
    replaceable model Law = Single constrainedby Base;
    replaceable type Level = Real;
    replaceable record Data = Row;
    replaceable package Medium = M;
    Law law;
    Level x;
    Data data;
    Real y = law.y, z = data.a, g = Medium.g(time), d = Medium.d;
  equation
    der(x) = 0;
  end B;
  model Nested
    replaceable model Kind = B;
    Kind b;
  end Nested;
  DECLARED
end K;
"""


def value(declared: str, name: str, modifiers: str = "") -> float:
    text = TEXT.replace("DECLARED", declared if "model A" in declared else f"model A {declared} end A;")
    text = re.sub(r"model A (model C .*? end C;)", r"\1 model A", text)
    return float(simulate(load(text, f"K.A{modifiers}"), 1.0, save="end")[name][-1])


@pytest.mark.parametrize(
    ("declared", "name", "expected"),
    [
        ("B b(redeclare model Law = Twice(k = 5));", "b.y", 10.0),
        ("extends B(redeclare model Law = Twice(k = 5), redeclare record Data = Row(a = 4));", "z", 4.0),
        ("parameter Real kk = 6; B b(redeclare model Law = Single(k = kk)) annotation (Icon(a = {0}));", "b.y", 6.0),
        ("B b[2](redeclare model Law = Twice(k = 5));", "b[2].y", 10.0),
        ("B b(redeclare type Level = Real(start = 4, fixed = true));", "b.x", 4.0),
        ("B b(redeclare package Medium = M(c = 5));", "b.d", 10.0),
        ("B b(redeclare package Medium = M(c = 5, redeclare function f = h));", "b.g", 15.0),
        ("Nested n(redeclare model Kind = B(redeclare model Law = Twice(k = 7)));", "n.b.y", 14.0),
        ("package P = M(redeclare function f = h); Real y = P.g(time);", "y", 9.0),
        ("package P = M(c = 5, redeclare function f = h); Real y = P.g(time);", "y", 15.0),
        ("model C replaceable Single p constrainedby Base(k = 7); end C; C c;", "c.p.y", 7.0),
        ("model C replaceable Single p constrainedby Base(k = 7); end C; C c(redeclare Twice p);", "c.p.y", 14.0),
    ],
)  # fmt: skip
def test_the_modifiers_of_a_redeclaration_take_effect(declared: str, name: str, expected: float) -> None:
    assert value(declared, name) == expected


def test_redeclarations_of_the_loaded_model() -> None:
    assert value("extends B;", "y", "(redeclare model Law = K.Twice(k = 5))") == 10.0
    assert value("B b;", "b.y", "(b(redeclare model Law = K.Twice(k = 3)))") == 6.0


@pytest.mark.parametrize(
    ("declared", "expected"),
    [
        ("replaceable model N = Single constrainedby Base(k = 7); N n; Real y = n.y;", 7.0),
        ("replaceable Single p(k = 3) constrainedby Base(k = 7); Real y = p.y;", 3.0),
        (
            # Modifiers of the declaration hold for its redeclarations only if it states no constraint.
            "model C replaceable Single p(k = 3) constrainedby Base; end C; "
            "model A C c(redeclare Twice p); Real y = c.p.y; end A;",
            2.0,
        ),
        ("package P = M(c = 5); Real y = P.d + M.d;", 16.0),
        ("Nested n(b(redeclare model Law = Twice(k = 9))); Real y = n.b.y;", 18.0),
    ],
)
def test_modifiers_reach_what_they_modify_and_nothing_else(declared: str, expected: float) -> None:
    assert value(declared, "y") == expected


@pytest.mark.parametrize(
    ("declared", "expected"),
    [
        (
            "model C function f = h; Real y = f(time); end C; "
            "model D replaceable function f = M.f; Real y = f(time); end D; "
            "model A C c; D d; Real y = c.y + 10 * d.y; end A;",
            23.0,
        ),
        (
            "model C function f output Real y = 1; algorithm end f; Real y = f(); end C; "
            "model D function f output Real y = 2; algorithm end f; Real y = f(); end D; "
            "model A C c; D d; Real y = c.y + 10 * d.y; end A;",
            21.0,
        ),
        (
            "model C package P = M; Real y = P.g(1); end C; package P = M(c = 5); C c; Real y = P.g(1) + 100 * c.y;",
            610.0,
        ),
        (
            "function q input Real x; input Real k; output Real y; algorithm y := k * x; end q; "
            "model A inner function f = q(k = 4); Real y = f(time); end A;",
            4.0,
        ),
    ],
)
def test_classes_of_one_name_in_different_models_are_different(declared: str, expected: float) -> None:
    assert value(declared, "y") == expected
