"""Redeclarations and modifiers of classes: right, or refused with file and line."""

import re

import pytest

from acausal import simulate
from acausal.modelica import ModelicaError, load

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


def test_a_redeclaration_of_the_loaded_model() -> None:
    assert value("extends B;", "y", "(redeclare model Law = K.Twice(k = 5))") == 10.0
    with pytest.raises(ModelicaError, match=r"^\(b\(redeclare .*: the front end loses the redeclaration"):
        value("B b;", "b.y", "(b(redeclare model Law = K.Twice))")


@pytest.mark.parametrize(
    ("declared", "message"),
    [
        ("replaceable model N = Single constrainedby Base(k = 7); N n;", "loses modifiers after constrainedby"),
        ("replaceable Single p(k = 3) constrainedby Base(k = 7);", "loses modifiers after constrainedby"),
        (
            "model C replaceable Single p(k = 3) constrainedby Base; end C; model A C c(redeclare Twice p); end A;",
            "applies the modifiers of p to its redeclarations",
        ),
        ("package P = M(c = 5); Real y = P.d + M.d;", "gives them to M itself"),
        (
            "Nested n(b(redeclare model Law = Twice)); Real y = 1;",
            "loses the redeclaration in the modifier of a modifier",
        ),
        (
            "model C function f = h; Real y = f(time); end C; "
            "model D replaceable function f = M.f; Real y = f(time); end D; model A C c; D d; end A;",
            "another model declares f, too",
        ),
        (
            "model C function f output Real y = 1; algorithm end f; Real y = f(); end C; "
            "model D function f output Real y = 2; algorithm end f; Real y = f(); end D; "
            "model A C c; D d; Real y = c.y + d.y; end A;",
            "another model declares f, too",
        ),
        (
            "model C package P = M; Real y = P.g(1); end C; package P = M(c = 5); C c; Real y = P.g(1);",
            "declares P, too",
        ),
        (
            "function q input Real x; input Real k; output Real y; algorithm y := k * x; end q; "
            "model A inner function f = q(k = 4); Real y = f(time); end A;",
            "loses the modifiers of the inner function f",
        ),
    ],
)
def test_modifiers_that_the_front_end_loses_are_refused(declared: str, message: str) -> None:
    with pytest.raises(ModelicaError, match=rf"<model>\.mo, line 30: .*{message}.*Remedy: "):
        value(declared, "y")
