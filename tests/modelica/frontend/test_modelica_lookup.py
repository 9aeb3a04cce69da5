"""Names of classes and components (Modelica 3.6, chapters 5 and 13)."""

from pathlib import Path

import pytest
from flat_text import flat, variables

from acausal.modelica import ModelicaError
from acausal.modelica._frontend.flatten import flat_model


def test_all_kinds_of_imports() -> None:
    text = """
        package P package Q constant Real a = 1; constant Real b = 2; constant Real c = 3; end Q; end P;
        model M
          import P.Q; import R = P.Q; import P.Q.{a, b}; import P.Q.*;
          Real v[5] = {Q.a, R.b, a, b, c};
        end M;"""
    assert variables(text) == {"v[5]": "{1.0, 2.0, 1.0, 2.0, 3.0}"}


def test_inner_classes_hide_outer_ones_and_encapsulated_ones_do_not_look_out() -> None:
    text = """
        package P
          constant Real k = 1;
          package Q constant Real k = 2; model A Real x = k; end A; end Q;
          encapsulated package E model A Real x = k; end A; end E;
          model M Q.A a; Real y = k; end M;
          model N E.A a; end N;
        end P;"""
    assert variables(text, "P.M") == {"a.x": "2.0", "y": "1.0"}
    with pytest.raises(ModelicaError, match="there is no variable or class k"):
        variables(text, "P.N")


def test_inner_and_outer_components() -> None:
    text = """
        model World parameter Real g = 9; end World;
        model A outer World world; Real x = world.g; end A;
        model B inner World world(g = 5); A a; end B;
        model M inner World world(g = 7); A a; B b; end M;"""
    assert variables(text) == {"world.g": "7", "a.x": "world.g", "b.world.g": "5", "b.a.x": "b.world.g"}


def test_the_structure_follows_the_inner_component() -> None:
    text = """
        model World parameter Integer n = 1; parameter Boolean b = false; end World;
        model A outer World world; Real x[world.n]; Real y if world.b; end A;
        model M inner World world(n = 3, b = true); A a; end M;"""
    assert list(variables(text)) == ["world.n", "world.b", "a.x[3]", "a.y"]


def test_a_partial_outer_class_and_a_missing_inner_component() -> None:
    text = """
        partial model World parameter Real g; end World;
        model Own extends World(g = 3); end Own;
        model A outer World world; Real x = world.g; end A;
        model M inner Own world; A a; end M;
        model N A a; end N;"""
    assert variables(text) == {"world.g": "3", "a.x": "world.g"}
    with pytest.raises(ModelicaError, match=r"outer component a\.world has no inner component"):
        flat(text, "N")
    whole = text.replace("partial model World parameter Real g;", "model World parameter Real g = 2;")
    assert variables(whole, "N") == {"a.x": "world.g", "world.g": "2"}


def test_an_outer_class() -> None:
    text = """
        model B Real x; Real y; end B;
        model A Real x; end A;
        model C outer model T = A; T t; end C;
        model M inner model T = B; C c; end M;"""
    assert list(variables(text)) == ["c.t.x", "c.t.y"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("model M Real x = valeu; Real value; end M;", r"there is no variable or class valeu\. Did you mean value"),
        ("model M Raal x; end M;", r"there is no class Raal\. Did you mean Real"),
        ("package P model Pump end Pump; end P; model M P.Pmup b; end M;", r"P has no element Pmup\. Did"),
        (
            "model A Real flow_x; end A; model M A a; Real y = a.flow_y; end M;",
            r"a has no element flow_y\. Did you mean flow_x",
        ),
        ("model M Real x; x y; end M;", "x is a component, not a class"),
        ("model M Real k; model A Real x = k; end A; A a; end M;", "belongs to M, around A, and is not a constant"),
        ("model M import P.Q; Q q; end M;", r"there is no class P\.Q to import"),
        ("package P model A Real x; end A; end P; model M Real y = P.A.x; end M;", "is not a constant"),
    ],
)
def test_unknown_names_are_refused_with_a_suggestion(text: str, message: str) -> None:
    with pytest.raises(ModelicaError, match=message) as found:
        flat(text)
    assert str(found.value).startswith("<model>.mo:1:")


def test_a_missing_library_is_named_with_its_version(tmp_path: Path) -> None:
    (tmp_path / "Plant.mo").write_text(
        'package Plant model M Hydro.Pump pump; end M; annotation(uses(Hydro(version = "2.1"))); end Plant;'
    )
    message = r"no class Hydro\.Pump\. Plant\.M needs the library Hydro 2\.1\. Give its folder"
    with pytest.raises(ModelicaError, match=message):
        flat_model("", "Plant.M", [tmp_path])
    with pytest.raises(ModelicaError, match=r"<model>\.mo:1:17: .*If Hydro is a library, .*; none are given\."):
        flat_model("model M extends Hydro.Pump; end M;", "M")


def test_a_missing_model_is_named() -> None:
    with pytest.raises(ModelicaError, match=r"There is no model Pulnt\.A\. Did you mean Plant"):
        flat("package Plant model A end A; end Plant;", "Pulnt.A")
    with pytest.raises(ModelicaError, match=r"Plant has no element Pmup\. Did you mean Pump"):
        flat("package Plant model Pump end Pump; end Plant;", "Plant.Pmup")


def test_modifiers_of_the_model_itself() -> None:
    assert variables("model M parameter Real x = 1; end M;", "M(x = 2)") == {"x": "2"}
    with pytest.raises(ModelicaError, match="the modifiers of M:1:2: M has no element y"):
        flat("model M parameter Real x = 1; end M;", "M(y = 2)")
