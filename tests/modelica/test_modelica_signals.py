"""Connections of signals in any order, through arrays and beside pins, against closed forms."""

from typing import Any

import numpy as np
import pytest

from acausal import simulate
from acausal.modelica import load

CROSSED = """package Crossed
  connector In = input Boolean;
  connector Out = output Boolean;
  block Step
    parameter Real at;
    Out y;
  equation
    y = time > at;
  end Step;
  block And
    In u[2];
    Out y;
  equation
    y = u[1] and u[2];
  end And;
  model Gates
    Step a(at = 0.3), b(at = 0.6);
    And first, second;
    Real x(start = 0, fixed = true);
  equation
    der(x) = if first.y and second.y then 1 else 0;
    connect(a.y, first.u[1]);
    connect(a.y, second.u[1]) "a note" annotation (Line(points =
      {{0, 0}, {1, 1}}));
    connect(b.y, second.u[2]);
    connect(b.y, first.u[2]);
  end Gates;
end Crossed;
"""

MESH = """package Mesh
  connector In = input Boolean;
  connector Out = output Boolean;
  connector Pin Real v; flow Real i; end Pin;
  block Step
    parameter Real at;
    Out y;
  equation
    y = time > at;
  end Step;
  block And
    In u[2];
    Out y;
    Out q if false;
  equation
    y = u[1] and u[2];
  end And;
  model Gates
    Step a(at = 0.3), b[2](at = {0.6, 0.8});
    And first, second, third;
    Boolean late;
    Real x(start = 0, fixed = true), w(start = 0, fixed = true), z(start = 0, fixed = true);
  protected
    In control[2];
    In off if false;
  equation
    if a.y then
      late = time >= 0.7;
    else
      late = false;
    end if;
    der(w) = if late then 1 else 0;
    der(x) = if third.y then 1 else 0;
    der(z) = if control[1] and not control[2] then 1 else 0;
    connect(a.y, first.u[1]); connect(b[1].y, first.u[2]);
    connect(a.y, second.u[2]); connect(first.y,
      second.u[1]);
    connect(first.y, third.u[2]) "a note" annotation (Line(points = {{0, 0}, {1, 1}}));
    connect(second.y, third.u[1]);
    connect(b.y, control);
    connect(first.q, off);
  end Gates;
  model Source
    Pin y;
  equation
    y.v = 1;
  end Source;
  model Load
    Pin v;
  equation
    v.i = 3 * v.v;
  end Load;
end Mesh;
"""


def test_signals_reach_arrays_in_any_order_of_the_connections() -> None:
    sol: Any = simulate(load(CROSSED, "Crossed.Gates"), 1.0)
    assert np.isclose(sol["x"][-1], 0.4, atol=1e-6)


def test_signals_reach_arrays_in_any_order_through_arrays() -> None:
    """No order of these connections passes through the arrays in one order. A connection of disabled parts is none, and
    an if-equation of a Boolean is one of numbers.
    """
    sol: Any = simulate(load(MESH, "Mesh.Gates"), 1.0)
    assert np.isclose(sol["x"][-1], 0.4, atol=1e-6)
    assert np.isclose(sol["z"][-1], 0.2, atol=1e-6)
    assert np.isclose(sol["w"][-1], 0.3, atol=1e-6)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("size", "wiring"),
    [
        ("", "connect(left.y, right.v);"),
        ("[2]", "connect(left.y, right.v);"),
        ("[2]", "connect(left[1].y, right[1].v); connect(left[2].y, right[2].v);"),
    ],
)
def test_a_pin_may_have_the_name_of_a_signal(size: str, wiring: str) -> None:
    wires = f"extends Gates; Source left{size}; Load right{size}; equation {wiring}"
    text = MESH.replace("end Mesh;", f"model Wires {wires} end Wires;\nend Mesh;")
    sol: Any = simulate(load(text, "Mesh.Wires"), 1.0)
    assert np.isclose(sol["x"][-1], 0.4, atol=1e-6)
    assert np.isclose(sol[f"right{size.replace('2', '1')}.v.i"][-1], 3.0)


ONCE = """model Once
  parameter Real period = 1e60;
  Integer n(start = 0, fixed = true);
  Real x(start = 0, fixed = true);
equation
  der(x) = n;
  when pre(n) >= 0 and sample(0.25, period) then
    n = pre(n) + 1;
  end when;
end Once;
"""


def test_a_sample_may_have_a_period_without_an_exact_ratio() -> None:
    sol: Any = simulate(load(ONCE, "Once"), 1.0)
    assert np.isclose(sol["x"][-1], 0.75, atol=1e-6)
