"""Models that the last pass of the front end refuses as they are written, against closed forms."""

from typing import Any

import numpy as np
import pytest

from acausal import simulate
from acausal.modelica import ModelicaError, load

pytest.importorskip("rumoca")

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
    In control[2];
    In off if false;
    Boolean late;
    Real x(start = 0, fixed = true), w(start = 0, fixed = true), z(start = 0, fixed = true);
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
  model Wired
    extends Gates;
    Source left;
    Source right;
  equation
    connect(left.y, right.y);
  end Wired;
end Mesh;
"""

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


def test_a_pin_with_the_name_of_a_signal_is_refused_beside_such_connections() -> None:
    with pytest.raises(
        ModelicaError, match=r"cannot direct the signals of this model, because left\.y is named as one"
    ):
        load(MESH, "Mesh.Wired")


@pytest.mark.parametrize("wiring", ["connect(left.y, right.y);", "connect(left[1].y, right[1].y);"])
def test_pins_in_arrays_with_the_name_of_a_signal_are_refused(wiring: str) -> None:
    text = MESH.replace(
        "end Mesh;",
        f"""
      model Wires
        extends Gates;
        Source left[2];
        Source right[2];
      equation
        {wiring}
      end Wires;
    end Mesh;""",
    )
    with pytest.raises(ModelicaError, match="cannot direct the signals of this model, because left"):
        load(text, "Mesh.Wires")


def test_a_sample_may_have_a_period_without_an_exact_ratio() -> None:
    sol: Any = simulate(load(ONCE, "Once"), 1.0)
    assert np.isclose(sol["x"][-1], 0.75, atol=1e-6)
