"""Connections, streams, overconstrained and expandable connectors (Modelica 3.6, chapters 9 and 15)."""

import pytest
from flat_text import equations, flat, variables

from acausal.modelica import ModelicaError

PIN = "connector Pin Real v; flow Real i; end Pin; model R Pin p, n; end R; "


def test_potentials_are_equal_and_flows_add_to_zero() -> None:
    assert equations(
        PIN + "model M R a, b, c; equation connect(a.p, b.p); connect(b.p, c.p); connect(a.n, b.n); end M;"
    ) == [
        "a.p.v = b.p.v",
        "a.p.v = c.p.v",
        "a.n.v = b.n.v",
        "((a.p.i + b.p.i) + c.p.i) = 0",
        "(a.n.i + b.n.i) = 0",
        "c.n.i = 0",
    ]


def test_the_flow_of_a_connector_of_the_model_has_the_other_sign_inside() -> None:
    text = (
        PIN + "model A Pin q; R r; equation connect(q, r.p); end A; model M A a, b; equation connect(a.q, b.q); end M;"
    )
    assert {one for one in equations(text) if ".i" in one and "r.n" not in one} == {
        "(-a.q.i + a.r.p.i) = 0",
        "(-b.q.i + b.r.p.i) = 0",
        "(a.q.i + b.q.i) = 0",
    }


def test_arrays_of_connectors() -> None:
    text = PIN + "model M R r[3]; equation for i in 1:2 loop connect(r[i].n, r[i + 1].p); end for; end M;"
    assert equations(text)[:2] == ["r[1].n.v = r[2].p.v", "r[2].n.v = r[3].p.v"]
    whole = PIN + "model M R r[2]; R s[2]; equation connect(r.n, s.p); end M;"
    assert equations(whole)[:2] == ["r[1].n.v = s[1].p.v", "r[2].n.v = s[2].p.v"]


def test_arrays_of_signals_stay_together_unless_elements_are_connected() -> None:
    text = """
        connector In = input Real; connector Out = output Real;
        model B In u[2]; Out y[2]; end B;
        model M B a, b; equation connect(a.y, b.u); end M;
        model N B a, b; equation connect(a.y[1], b.u[2]); connect(a.y[2], b.u[1]); end N;"""
    assert equations(text) == ["a.y = b.u"]
    assert equations(text, "N") == ["a.y[1] = b.u[2]", "a.y[2] = b.u[1]"]


def test_a_connection_of_an_absent_component_is_absent() -> None:
    text = (
        PIN
        + "model M parameter Boolean b = false; R a, c; R d if b; equation connect(a.p, d.p); connect(a.p, c.p); end M;"
    )
    assert equations(text)[0] == "a.p.v = c.p.v"


STREAM = """
    connector Port Real p; flow Real m; stream Real h; end Port;
    model V Port a; Real y = inStream(a.h); Real z = actualStream(a.h); equation a.h = 1; end V; """


def test_streams_of_one_two_and_three_connectors() -> None:
    one = variables(STREAM + "model M V a; end M;")
    assert one["a.y"] == "a.a.h"
    two = variables(STREAM + "model M V a, b; equation connect(a.a, b.a); end M;")
    assert two["a.y"] == "b.a.h"
    assert two["a.z"] == "if (a.a.m > 0.0) then b.a.h else a.a.h"
    three = variables(STREAM + "model M V a, b, c; equation connect(a.a, b.a); connect(a.a, c.a); end M;")
    flows = "Max(-b.a.m, 1e-07)", "Max(-c.a.m, 1e-07)"
    assert three["a.y"] == f"((({flows[0]} * b.a.h) + ({flows[1]} * c.a.h)) / ({flows[0]} + {flows[1]}))"


def test_streams_of_substances() -> None:
    text = STREAM.replace("stream Real h;", "stream Real h; stream Real x[2];").replace(
        "a.h = 1;", "a.h = 1; a.x = {1, 2};"
    )
    text = text.replace("Real y = inStream(a.h);", "Real y[2] = inStream(a.x); Real w = inStream(a.x[2]);")
    found = variables(text + "model M V a, b; equation connect(a.a, b.a); end M;")
    assert found["a.y[2]"] == "{b.a.x[1], b.a.x[2]}"
    assert found["a.w"] == "b.a.x[2]"


def test_vectors_of_flows_stay_together() -> None:
    text = """
        connector F Real r[3]; flow Real f[3]; end F; model A F a; end A;
        model M A a, b, c; equation connect(a.a, b.a); end M;"""
    assert equations(text) == ["a.a.r = b.a.r", "(a.a.f + b.a.f) = 0", "c.a.f = 0"]


def test_streams_through_the_connector_of_a_model() -> None:
    text = (
        STREAM
        + "model A Port q; V v; equation connect(q, v.a); end A; model M A a; V b; equation connect(a.q, b.a); end M;"
    )
    assert "a.q.h = a.v.a.h" in equations(text)
    assert variables(text)["a.v.y"] == "b.a.h"


LOOP = """
    record O Real t[2];
      function equalityConstraint input O a; input O b; output Real r[1]; algorithm r := {a.t[1] - b.t[1]};
      end equalityConstraint; end O;
    connector F O o; flow Real f; end F;
    model Root F a; Real x; equation Connections.root(a.o); a.o.t = {1, 2};
      x = if Connections.isRoot(a.o) then 1 else 2; end Root;
    model Rod F a, b; Boolean r = Connections.rooted(a.o); equation Connections.branch(a.o, b.o); a.o = b.o; end Rod;"""


def test_loops_of_overconstrained_connectors_are_broken() -> None:
    text = (
        LOOP
        + """
        model M Root w; Rod a, b; equation connect(w.a, a.a); connect(w.a, b.a); connect(a.b, b.b); end M;"""
    )
    found = equations(text)
    assert "w.a.o.t = a.a.o.t" in found
    assert "w.a.o.t = b.a.o.t" in found
    assert "Zeros(1) = O.equalityConstraint(a.b.o, b.b.o)" in found
    assert not any(one.startswith("a.b.o.t") for one in found if "b.b.o.t" in one)
    assert "w.x = 1" in found
    assert variables(text)["a.r"] == "true"


def test_expandable_connectors_get_the_elements_that_are_connected() -> None:
    text = """
        connector In = input Real; connector Out = output Real;
        expandable connector Bus end Bus;
        model S Out y = 1; end S; model T In u; end T;
        model A Bus bus; S s; equation connect(s.y, bus.speed); end A;
        model M Bus bus; A a; T t; equation connect(bus, a.bus); connect(bus.speed, t.u); end M;"""
    found = flat(text)
    assert found.variables["bus.speed"].is_expandable
    assert {"bus.speed", "a.bus.speed"} <= found.variables.keys()
    assert len(equations(text)) == 3  # of four signals


AB = "connector A {a}; end A; connector B {b}; end B; model M A a; B b; equation connect(a, b); end M;"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            AB.format(a="Real x", b="Real y"),
            "do not match",
        ),
        (
            AB.format(a="Real x", b="flow Real x"),
            "do not match",
        ),
        ("connector A Real x; end A; model M A a; A b[2]; equation connect(a, b); end M;", "different sizes"),
        (
            AB.format(a="Real x[2]", b="Real x[3]"),
            "different sizes",
        ),
        (
            AB.format(a="Real x", b="Integer x"),
            "of type Real",
        ),
        ("model A Real x; end A; model M A a, b; equation connect(a, b); end M;", "is a model, not a connector"),
        ("model M Real x, y; equation connect(x, y); end M;", "not a connector"),
    ],
)
def test_connectors_that_do_not_match_are_refused(text: str, message: str) -> None:
    with pytest.raises(ModelicaError, match=message) as found:
        flat(text)
    assert str(found.value).startswith("<model>.mo:1:")


def test_flows_in_expandable_connectors_may_be_open_inside_and_outside() -> None:
    text = """connector F Real e; flow Real f; end F; expandable connector B end B;
        model L B b; F p; equation connect(p, b.x); end L;
        model N B b; end N;
        model M L l; N n; equation connect(l.b, n.b); end M;"""
    assert [one for one in equations(text) if ".f" in one] == [
        "(-l.p.f + -l.b.x.f) = 0", "(l.b.x.f + n.b.x.f) = 0", "l.p.f = 0", "n.b.x.f = 0",
    ]  # fmt: skip


def test_types_may_be_overconstrained() -> None:
    text = """type Angle extends Real; function equalityConstraint input Angle a[:]; input Angle b[:]; output Real r[0];
        algorithm end equalityConstraint; end Angle;
        connector F Real e; flow Real f; Angle theta[2]; end F;
        model S F p; equation p.f = p.e; Connections.potentialRoot(p.theta);
          if Connections.isRoot(p.theta) then p.theta = {1, 2}; end if; end S;
        model M S a, b, c; equation connect(a.p, b.p); connect(b.p, c.p); connect(c.p, a.p); end M;"""
    assert [one for one in equations(text) if "theta" in one] == [
        "a.p.theta = {1, 2}", "a.p.theta = b.p.theta", "a.p.theta = c.p.theta",
    ]  # fmt: skip


OUTER = """
    connector C Real e; flow Real f; end C;
    model World C c; equation c.e = 10; end World;
    model Part C c; equation c.f = c.e; end Part;
"""


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        # The connector of an outer component is inside, for a part and for a connector of the class itself
        (
            "model A outer World w; Part p; equation connect(p.c, w.c); end A; model B A a; end B;"
            "model M inner World w; A a; B b; end M;",
            ["((a.p.c.f + w.c.f) + b.a.p.c.f) = 0"],
        ),
        (
            "model A outer World w; C c; Part p; equation connect(c, w.c); connect(p.c, c); end A;"
            "model M inner World w; A a; Part p; equation connect(p.c, a.c); end M;",
            ["(p.c.f + a.c.f) = 0", "((-a.c.f + w.c.f) + a.p.c.f) = 0"],
        ),
        # An outer connector belongs to the class that declares the inner one, which is inside for others
        (
            "model A outer C w; Part p; equation connect(p.c, w); end A;"
            "model T inner C w; A a[2]; World g; end T; model M T t; Part p; equation connect(t.w, p.c); end M;",
            ["(t.w.f + p.c.f) = 0", "((t.a[1].p.c.f + -t.w.f) + t.a[2].p.c.f) = 0", "t.g.c.f = 0"],
        ),
        (
            "model A outer C w; Part p; equation connect(p.c, w); end A;"
            "model M inner C w; A a; World g; equation connect(g.c, w); end M;",
            ["((g.c.f + -w.f) + a.p.c.f) = 0", "w.f = 0"],
        ),
        # An inner outer connector is the outer one in its class, and the inner one for the parts
        (
            "model A outer C w; Part p; equation connect(p.c, w); end A;"
            "model T inner outer C w; A a; Part q; equation connect(q.c, w); end T;"
            "model M inner C w; T t; World g; equation connect(g.c, w); end M;",
            ["((g.c.f + -w.f) + t.q.c.f) = 0", "(t.a.p.c.f + -t.w.f) = 0", "w.f = 0", "t.w.f = 0"],
        ),
    ],
)
def test_connections_of_outer_connectors(text: str, expected: list[str]) -> None:
    found = [one for one in equations(OUTER + text) if ".f" in one and ".e" not in one]
    assert sorted(found) == sorted(expected)
