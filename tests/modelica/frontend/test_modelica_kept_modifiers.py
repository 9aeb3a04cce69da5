"""Modifiers that a redeclared element has from its constraint and from the modifiers between (section 7.3.2)."""

import pytest
from flat_text import variables

from acausal.modelica import ModelicaError

# Each class has its own values, so that a value tells which modifier it is from.
TEXT = """
package K
  model P parameter Real a = 0; end P;
  model A parameter Real a = 1; parameter Real b = 2; end A;
  model B parameter Real a = 10; parameter Real b = 20; parameter Real c = 30; end B;
  model E parameter Real a = 100; parameter Real b = 200; parameter Real c = 300; end E;
  model Plain replaceable model T = A; T t; end Plain;
  model Short replaceable model T = A(a = 3); T t; end Short;
  model Bound replaceable model T = A(b = 4) constrainedby P(a = 5); T t; end Bound;
  model Component replaceable A t(a = 3); end Component;
  model BoundComponent replaceable A t(b = 4) constrainedby P(a = 5); end BoundComponent;
  package Medium replaceable constant Real k = 1; constant Real l = 2; end Medium;
  package Salt constant Real k = 10; constant Real l = 20; end Salt;
  model Pipe replaceable package M = Medium; parameter Real k = M.k; parameter Real l = M.l; end Pipe;
  model Plant replaceable package M = Medium(l = 7); Pipe t(redeclare package M = M); end Plant;
  DECLARED
end K;
"""
# Classes whose package is not replaceable, and a constraint that redeclares it
SALTED = (
    "model Salted extends Pipe(redeclare package M = Salt); end Salted; "
    "model Line replaceable Pipe t constrainedby Pipe(redeclare package M = Salt); end Line; "
    "model Sensor replaceable package M = Salt; end Sensor;"
)


def values(declared: str) -> dict[str, str | None]:
    text = declared if "model X" in declared else f"model X {declared} end X;"
    found = variables(TEXT.replace("DECLARED", text), "K.X")
    return {name.rsplit(".")[-1]: value for name, value in found.items() if name.endswith(("a", "b", "c", "k", "l"))}


@pytest.mark.parametrize(
    ("declared", "a", "b"),
    [
        # The modifiers of a short class, or of a component, without a constraint
        ("Short s(redeclare model T = B);", "3", "20"),
        ("Short s(redeclare model T = B(a = 6));", "6", "20"),
        ("Component s(redeclare B t);", "3", "20"),
        ("Component s(redeclare B t(b = 6));", "3", "6"),
        # With one, those of the constraint only
        ("Bound s(redeclare model T = B);", "5", "20"),
        ("Bound s(redeclare model T = B(a = 6));", "6", "20"),
        ("BoundComponent s(redeclare B t);", "5", "20"),
        # Modifiers between
        ("model Y extends Plain(T(b = 8)); end Y; model X Y s(redeclare model T = B); end X;", "10", "8"),
        ("model Y extends Bound(T(a = 8)); end Y; model X Y s(redeclare model T = B); end X;", "8", "20"),
        ("model Y extends Bound(T(a = 8)); end Y; model X Y s(redeclare model T = B(a = 9)); end X;", "9", "20"),
        ("model Y Plain s(T(b = 8)); end Y; model X Y y(s(redeclare model T = B)); end X;", "10", "8"),
        ("model Y extends Component(t(b = 8)); end Y; model X Y s(redeclare B t); end X;", "3", "8"),
        ("model Y Component s(t(b = 8)); end Y; model X Y y(s(redeclare B t(a = 9))); end X;", "9", "8"),
        # Through two levels; the outer one has priority
        (
            "model Y extends Plain(T(a = 7, b = 8)); end Y; model Z extends Y(T(b = 9)); end Z; "
            "model X extends Z(redeclare model T = B); end X;",
            "7", "9",
        ),
        # A redeclaration by another one: of the first, the modifiers of its constraint, and those of it between
        (
            "model Y extends Short(redeclare replaceable model T = B(b = 8)); end Y; "
            "model X Y s(redeclare model T = E); end X;",
            "3", "200",
        ),
        (
            "model Y extends Short(redeclare replaceable model T = B constrainedby A(b = 8)); end Y; "
            "model X Y s(redeclare model T = E); end X;",
            "3", "8",
        ),
        (
            "model Y extends Short(redeclare replaceable model T = B); end Y; model Z extends Y(T(b = 9)); end Z; "
            "model X Z s(redeclare model T = E); end X;",
            "3", "9",
        ),
        (
            "model Y extends Component(redeclare replaceable B t(b = 8)); end Y; "
            "model X Y s(redeclare E t); end X;",
            "3", "200",
        ),
        (
            "model Y extends Component(redeclare replaceable B t constrainedby A(b = 8)); end Y; "
            "model Z extends Y(t(a = 9)); end Z; model X Z s(redeclare E t); end X;",
            "9", "8",
        ),
        # A redeclaration as an element, and modifiers of it outside
        ("model Y extends Bound; redeclare model T = B(b = 6); end Y; model X Y s(T(b = 9)); end X;", "5", "9"),
        ("model Y extends Short; redeclare model T = B(b = 6); end Y; model X Y s; end X;", "3", "6"),
        (
            "model Y extends Short(T(b = 7)); redeclare model extends T parameter Real c = a; end T; end Y; "
            "model X Y s(T(a = 9)); end X;",
            "9", "7",
        ),
        # `replaceable` in a modifier is a redeclaration
        ("Short s(replaceable model T = B(b = 6));", "3", "6"),
        # Modifiers of the component have priority over those of its class
        ("model Y extends Bound(redeclare model T = B(b = 6), t(a = 9)); end Y; model X Y s; end X;", "9", "6"),
        # A final modifier is stated once
        ("model Y replaceable model T = A(final b = 4) constrainedby P(a = 5); T t; end Y; model X Y s; end X;",
         "5", "4"),
    ],
)  # fmt: skip
def test_redeclared_elements_keep_modifiers(declared: str, a: str, b: str) -> None:
    found = values(declared)
    assert (found["a"], found["b"]) == (a, b)


@pytest.mark.parametrize(
    ("declared", "expected"),
    [
        ("Component s[2](redeclare B t(b = {6, 7}));", ["3", "3", "6", "7", "30", "30"]),
        (
            "model Y Component s[2](t(b = {6, 7})); end Y; model X Y y(s(redeclare B t(c = {8, 9}))); end X;",
            ["3", "3", "6", "7", "8", "9"],
        ),
        (
            "model Y Component s[2](t(b = {6, 7})); end Y; model X Y y(s(redeclare each B t(c = 8))); end X;",
            ["3", "3", "6", "7", "8", "8"],
        ),
        (
            "model Y Component s[2](t(b = {6, 7})); end Y; model X Y y(s(each t(a = 8))); end X;",
            ["8", "8", "6", "7"],
        ),
        (
            "model Y replaceable A t[2](a = {3, 4}); end Y; model X Y s(redeclare B t(b = {6, 7})); end X;",
            ["3", "4", "6", "7", "30", "30"],
        ),
    ],
)
def test_redeclared_elements_in_arrays_keep_modifiers(declared: str, expected: list[str]) -> None:
    text = declared if "model X" in declared else f"model X {declared} end X;"
    found = variables(TEXT.replace("DECLARED", text), "K.X")
    assert [found[name] for name in sorted(found, key=lambda name: (name[-1], name))] == expected


@pytest.mark.parametrize(
    ("declared", "k", "l"),
    [
        ("Plant s;", "1.0", "7.0"),
        ("Plant s(redeclare package M = Salt);", "10.0", "7.0"),
        ("Plant s(redeclare package M = Salt(k = 5));", "5.0", "7.0"),
        ("Plant s(M(k = 6));", "6.0", "7.0"),
        ("model Y Plant s(M(k = 6)); end Y; model X Y y(s(redeclare package M = Salt)); end X;", "6.0", "7.0"),
        ("model Y extends Plant(M(k = 6)); end Y; model X Y s[2](redeclare each package M = Salt); end X;",
         "6.0", "7.0"),
        # A redeclaration of a package that is not replaceable, by what it is already, changes nothing
        (f"{SALTED} model X extends Line(redeclare Salted t); end X;", "10.0", "20.0"),
        (f"{SALTED} model X extends Line(redeclare Pipe t(redeclare package M = Salt)); end X;", "10.0", "20.0"),
        (f"{SALTED} model X extends Salted(redeclare package M = Salt); end X;", "10.0", "20.0"),
        # Two base classes may have a package of one name if it is the same one
        (f"{SALTED} model X extends Pipe(redeclare replaceable package M = Salt); extends Sensor; end X;", "10.0",
         "20.0"),
        (f"{SALTED} model Y extends Pipe(redeclare replaceable package M = Salt); extends Sensor; end Y; "
         "model X extends Y(redeclare package M = Medium); end X;", "1.0", "2.0"),
    ],
)  # fmt: skip
def test_redeclared_packages_keep_modifiers(declared: str, k: str, l: str) -> None:  # noqa: E741
    found = values(declared)
    assert (found["k"], found["l"]) == (k, l)


@pytest.mark.parametrize(
    ("declared", "message"),
    [
        ("model Y replaceable model T = A constrainedby P(final a = 5); T t; end Y; "
         "model X Y s(redeclare model T = B(a = 6)); end X;", "final"),
        ("model Y extends Short(T(final a = 8)); end Y; model X Y s(redeclare model T = B(a = 6)); end X;", "final"),
        ("model Y extends Short(redeclare replaceable model T = B constrainedby B); end Y; "
         "model X Y s(redeclare model T = A); end X;", "T has no c, as B has"),
        ("Plain s(T(a = 7), redeclare model T = B(b = 8));", "modifies T twice"),
        (f"{SALTED} model X extends Salted(redeclare package M = Medium); end X;", "M cannot be redeclared"),
        (f"{SALTED} model Watered extends Pipe(redeclare package M = Medium); end Watered; "
         "model X extends Line(redeclare Watered t); end X;", "M cannot be redeclared"),
        (f"{SALTED} model X extends Pipe; extends Sensor; end X;", "two elements M that differ"),
    ],
)  # fmt: skip
def test_what_constraints_forbid_is_refused(declared: str, message: str) -> None:
    with pytest.raises(ModelicaError, match=message):
        values(declared)
