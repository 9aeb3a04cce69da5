"""Modification, redeclaration and inheritance (Modelica 3.6, chapter 7)."""

import pytest
from flat_text import flat, variables

from acausal.modelica import ModelicaError


def test_the_outer_modifier_has_priority() -> None:
    text = """
        model A parameter Real x = 1; parameter Real y = 2; parameter Real z = 3; end A;
        model B A a(x = 10, y = 20); end B;
        model M B b(a(x = 100)); end M;"""
    assert variables(text) == {"b.a.x": "100", "b.a.y": "20", "b.a.z": "3"}


def test_names_of_a_modifier_belong_to_its_own_scope() -> None:
    text = """
        model A parameter Real k = 1; parameter Real x = k; end A;
        model B parameter Real k = 2; A a(x = k); end B;
        model M parameter Real k = 3; B b(a(k = 4), k = k); end M;"""
    assert variables(text) == {"k": "3", "b.k": "k", "b.a.k": "4", "b.a.x": "b.k"}


def test_nested_modifiers_of_a_component_with_its_own_modifier() -> None:
    text = """
        model In parameter Real a = 1; end In;
        model R parameter Real k = 2; In i(a = 5); end R;
        model M R r(k = 3, i = In(a = 4)); end M;"""
    with pytest.raises(ModelicaError, match="In is a model, not a function"):
        variables(text)
    assert variables(text.replace("i = In(a = 4)", "i(a = 4)")) == {"r.k": "3", "r.i.a": "4"}


def test_dotted_modifiers_and_modifiers_of_extends() -> None:
    text = """
        model A parameter Real x = 1; parameter Real y = 1; end A;
        model B A a; parameter Real z = 0; end B;
        model C extends B(a.x = 2, a.y = 3, z = 5); end C;
        model M extends C(a(y = 4)); end M;"""
    assert variables(text) == {"a.x": "2", "a.y": "4", "z": "5"}


@pytest.mark.parametrize(
    ("modifier", "expected"),
    [
        ("x = {1, 2}", {"a[1].x": "1", "a[2].x": "2"}),
        ("each x = 3", {"a[1].x": "3", "a[2].x": "3"}),
        ("x = p", {"a[1].x": "p[1]", "a[2].x": "p[2]"}),
        ("x = 2*p", {"a[1].x": "((2 * p))[1]", "a[2].x": "((2 * p))[2]"}),
        ("each x(start = 3)", {"a[1].x": "1", "a[2].x": "1"}),
    ],
)
def test_modifiers_of_arrays_of_components(modifier: str, expected: dict[str, str]) -> None:
    text = f"""
        model A parameter Real x = 1; end A;
        model M parameter Real p[2] = {{5, 6}}; A a[2]({modifier}); end M;"""
    assert variables(text) == {"p[2]": "{5, 6}", **expected}


def test_modifiers_of_arrays_in_arrays() -> None:
    text = """
        model A parameter Real x = 1; end A;
        model B A a[2]; end B;
        model M B b[2](a(x = {{1, 2}, {3, 4}})); end M;"""
    assert variables(text) == {"b[1].a[1].x": "1", "b[1].a[2].x": "2", "b[2].a[1].x": "3", "b[2].a[2].x": "4"}


def test_redeclared_components_and_classes() -> None:
    text = """
        partial model P parameter Real p = 0; end P;
        model A extends P(p = 1); end A;
        model B extends P(p = 2); parameter Real q = 3; end B;
        model C replaceable A a constrainedby P(p = 7); replaceable model T = A; T t; end C;
        model M C c(redeclare B a, redeclare model T = B(q = 4)); C d; end M;"""
    assert variables(text) == {
        "c.a.p": "7", "c.a.q": "3", "c.t.p": "2", "c.t.q": "4", "d.a.p": "7", "d.t.p": "1",
    }  # fmt: skip


def test_a_plain_and_a_redeclared_package_keep_their_own_functions() -> None:
    text = """
        package P
          partial package Medium replaceable function f input Real x; output Real y; end f;
            constant Real c = 0; end Medium;
          package One extends Medium(c = 1); redeclare function extends f algorithm y := x; end f; end One;
          package Two extends Medium(c = 2); redeclare function extends f algorithm y := 2*x; end f; end Two;
          model A replaceable package Medium = One; Real y = Medium.f(Medium.c); end A;
          model M A a; A b(redeclare package Medium = Two); A c; end M;
        end P;"""
    found = {"a.y": "P.One.f(1.0)", "b.y": "P.Two.f(2.0)", "c.y": "P.One.f(1.0)"}
    assert variables(text, "P.M") == found
    bodies = {name: len(function.body) for name, function in flat(text, "P.M").functions.items()}
    assert bodies == {"P.One.f": 1, "P.Two.f": 1}


def test_a_package_with_modified_constants_has_functions_of_its_own() -> None:
    text = """
        package P
          package Base constant Real k = 2; function f input Real x; output Real y; algorithm y := k*x; end f; end Base;
          model M package Own = Base(k = 10); Real a = Base.f(1); Real b = Own.f(1); end M;
        end P;"""
    functions = flat(text, "P.M").functions
    assert variables(text, "P.M") == {"a": "P.Base.f(1)", "b": "Own.f(1)"}
    assert "2.0" in repr(functions["P.Base.f"].body)
    assert "10.0" in repr(functions["Own.f"].body)


def test_a_class_that_extends_the_one_that_it_replaces() -> None:
    text = """
        package P
          model Base replaceable model X parameter Real a = 1; end X; X x; end Base;
          model D extends Base; redeclare model extends X(a = 2) parameter Real b = a; end X; end D;
          model M D d; end M;
        end P;"""
    assert variables(text, "P.M") == {"d.x.a": "2", "d.x.b": "d.x.a"}


def test_removed_elements() -> None:
    text = """
        connector C Real e; flow Real f; end C;
        model A C c, d; Real x = 1; equation connect(c, d); end A;
        model M extends A(break x, break connect(c, d)); end M;"""
    found = flat(text)
    assert "x" not in found.variables
    assert {one.origin for one in found.equations} == {"open flow"}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("model A Real x; end A; model M A a(y = 1); end M;", "A has no element y to modify"),
        ("model M Real x(srart = 1); end M;", r"Real has no element srart to modify\. Did you mean start"),
        ("model A final parameter Real x = 1; end A; model M A a(x = 2); end M;", "final"),
        (
            "model A parameter Real x = 1; end A; model B A a(final x = 2); end B; model M B b(a(x = 3)); end M;",
            "final",
        ),
        ("model A protected Real x; end A; model M A a(x = 1); end M;", "protected"),
        ("model M Real x(start = 1, start = 2); end M;", "modifies start twice"),
        ("model A model T Real x; end T; end A; model M A a(redeclare model T = A); end M;", "not replaceable"),
        ("model A Real x; end A; model M extends A; Integer x; end M;", "two elements x that differ"),
        ("model M Real x; Real x; end M;", "declares x twice"),
        ("model A Real x; end A; model M A a[2](x = 1); end M;", "needs `each`"),
        ("model A Real x; end A; model M A a[3](x = {1, 2}); end M;", "2 values, but a has 3 members"),
        ("model A Real x; end A; model M A a[2](x = {1, 2, 3}); end M;", "3 values, but a has 2 members"),
        ("model A Real x; end A; model M A a[2](x(start = {1, 2, 3})); end M;", "3 values, but a has 2 members"),
        (
            "model A Real x; end A; model B A a[2]; end B; model M B b[2](a(x = {{1, 2, 3}, {4, 5, 6}})); end M;",
            "3 values, but a has 2 members",
        ),
        ("model M extends M; end M;", "extends itself"),
        (
            "model A replaceable B b; end A; model B Real x; end B; model C end C; model M A a(redeclare C b); end M;",
            "has no x",
        ),
        (
            "model A replaceable model T Real x; end T; T t; end A; model C end C;"
            " model M A a(redeclare model T = C); end M;",
            "C has no x, as T has, which it replaces",
        ),
        ("model A replaceable Real x; end A; model M A a(redeclare Integer x); end M;", "Integer is no Real"),
        ("model M M m; end M;", "contains itself"),
        ("model M redeclare Real x; end M;", "no base class of M has x to redeclare"),
    ],
)
def test_wrong_modifications_are_refused(text: str, message: str) -> None:
    with pytest.raises(ModelicaError, match=message) as found:
        flat(text)
    assert str(found.value).startswith("<model>.mo:1:")


def test_fields_of_nested_records_get_the_value_of_the_outermost_record() -> None:
    text = """
        record F parameter Real v[:]; parameter Real w[size(v, 1)]; end F;
        record G parameter F f(v = {0, 0}, w = {0, 0}); end G;
        model C parameter G g; end C;
        model M parameter G g(f = F(v = {1, 2, 3}, w = {4, 5, 6})); C c(g = g); C d(g = g, g.f.v = {7, 8, 9}); end M;"""
    assert variables(text) == {
        "g.f.v[3]": "{1, 2, 3}", "g.f.w[3]": "{4, 5, 6}", "c.g.f.v[3]": "g.f.v", "c.g.f.w[3]": "g.f.w",
        "d.g.f.v[3]": "{7, 8, 9}", "d.g.f.w[3]": "g.f.w",
    }  # fmt: skip


def test_constructors_of_records_know_their_fields() -> None:
    text = "record R Real x; Real y[:]; Real z[size(y, 1)] = 2*y; end R; model M R r = R(x = 1, y = {1, 2}); end M;"
    inputs = flat(text).functions["R"].inputs
    assert variables(text) == {"r.x": "1", "r.y[2]": "{1, 2}", "r.z[2]": "(2 * {1, 2})"}
    assert repr(inputs[2].dims[0]) == "Builtin(name='Size', args=(Ref(name='y', subs=()), Const(value=1)))"


def test_a_redeclaration_has_priority_over_the_modifier_of_the_constraint() -> None:
    text = """
        model A parameter Real p = 1; parameter Real q = 2; end A;
        model C replaceable model T = A constrainedby A(p = 6, q = 7); T t; end C;
        model M C c; C d(redeclare model T = A(p = 4)); end M;"""
    assert variables(text) == {"c.t.p": "6", "c.t.q": "7", "d.t.p": "4", "d.t.q": "7"}


def test_each_is_no_value_for_all_elements_of_an_array() -> None:
    text = "model A parameter Real x = 1; end A; model M A a[3](each x = {1, 2, 3}); end M;"
    with pytest.raises(ModelicaError, match="x has size a scalar, but its value has size"):
        flat(text)


def test_a_redeclared_component_keeps_the_modifiers_between() -> None:
    text = """
        model A parameter Real k = 1; parameter Real l = 2; end A;
        model B extends A(l = 20); end B;
        model H replaceable A a(k = 100); end H;
        model H2 extends H(a(l = 7)); end H2;
        model M
          H2 between(redeclare B a), given(redeclare B a(l = 5)), plain;
          H own(redeclare B a);
          H4 replaced(redeclare B a);
        end M;
        model H4 extends H(redeclare replaceable B a(l = 8)); end H4;"""
    found = variables(text)
    assert [found[f"{name}.a.l"] for name in ("between", "given", "plain", "own", "replaced")] == [
        "7", "5", "7", "20", "20"
    ]  # fmt: skip
    assert {found[f"{name}.a.k"] for name in ("between", "given", "plain", "own")} == {"100"}
