"""Algorithms of models, against closed forms."""

from typing import Any

import jax
import numpy as np
import pytest
from numpy.testing import assert_allclose
from test_language import CONTINUOUS

from acausal import SimulationError, replace, simulate
from acausal.modelica import load
from acausal.modelica._frontend.flatten import flat_model
from acausal.modelica._syntax import expressions as e

MANY = """model Many
  type Level = enumeration(low, high);
  parameter Integer n = 3;
  constant Integer next[Level, Level] = [1, 2; 2, 1];
  Real sum, z[n], w, last(start = 0, fixed = true), y(start = 5, fixed = true);
  Integer ticks(start = 0, fixed = true), first(start = 0), count, halves;
  Level level(start = Level.low, fixed = true);
  Boolean late;
initial algorithm
  first := 4;
algorithm
  sum := 2 * time "a note; with := and {";
  if time > 1 then // a comment; with if
    sum := sum + 1;
  elseif time > 0.5 then
    late := true;
  else
    late := false;
  end if;
  for i in 1:n loop
    z[i] := time * i;
    if z[i] > 1 then
      break;
    end if;
  end for;
  count := 0;
  for i in 1:n, j in 1:2 loop
    count := count + (if time > i * j then 1 else 0);
  end for;
  halves := 0;
  w := 8 * time;
  while noEvent(w > 1 and halves < 10) loop
    w := w / 2;
    halves := halves + 1;
  end while;
algorithm
  when {sample(0.25, 0.5), time > 1.1} then
    ticks := pre(ticks) + 1;
    (, last) := both(time);
    level := if next[pre(level), Level.high] == 1 then Level.low else Level.high;
  elsewhen time > 0.9 then
    ticks := 100;
    first := pre(first) + 1;
  end when;
  assert(time < 1.4, "too late");
equation
  der(y) = 0;
public
  function both
    input Real u;
    output Real once;
    output Real twice;
  algorithm
    once := u;
    twice := 2 * u;
  end both;
end Many;
"""


@pytest.fixture(scope="module")
def many() -> Any:
    return load(MANY, "Many")


def test_statements_of_algorithms(many: Any) -> None:
    t = np.array([0.1, 0.3, 0.6, 0.8, 1.05, 1.3])
    sol: Any = simulate(many, 1.3, save=t)
    assert np.allclose(sol["sum"], 2 * t + (t > 1), atol=1e-9)
    assert np.allclose(sol["late"], t > 0.5)
    below = np.cumprod(np.column_stack([np.ones_like(t), *(t * i <= 1 for i in (1, 2))]), axis=1)
    assert np.allclose(sol["z"], below * np.outer(t, [1, 2, 3]), atol=1e-9)
    assert np.allclose(sol["count"], t > 1)
    halves = np.maximum(np.ceil(np.log2(8 * t)), 0)
    assert np.allclose(sol["halves"], halves)
    assert np.allclose(sol["w"], 8 * t / 2**halves, atol=1e-9)


def test_when_statements(many: Any) -> None:
    sol: Any = simulate(many, 1.3, save=np.array([0.1, 0.3, 0.8, 1.05, 1.3]))
    assert np.allclose(sol["ticks"], [0, 1, 2, 100, 102])
    assert np.allclose(sol["first"], [4, 4, 4, 5, 5])
    assert np.allclose(sol["last"], [0, 0.5, 1.5, 1.5, 2.5], atol=1e-6)
    assert np.allclose(sol["level"], [1, 2, 1, 1, 1])


def test_a_variable_that_is_never_set_keeps_its_start_beside_an_algorithm() -> None:
    """As `t_start` of a transition without timer in `Modelica.StateGraph`."""
    text = """
    model Beside
      discrete Real rate;
      discrete Real last;
      Real x(start = 1, fixed = true);
    initial equation
      pre(rate) = 2;
    equation
      der(x) = -rate * x;
      when false then
        rate = pre(rate);
      end when;
    algorithm
      when time > 0.5 then
        last := x;
      end when;
    end Beside;
    """
    sol = simulate(load(text, "Beside"), 1.0, save="end", rtol=1e-9)
    np.testing.assert_allclose([sol["x"][-1], sol["last"][-1]], np.exp([-2.0, -1.0]), rtol=1e-8)


def test_assertions_of_algorithms_hold_during_a_run(many: Any) -> None:
    with pytest.raises(SimulationError, match="too late"):
        simulate(many, 1.5)


def test_algorithms_stay_in_the_order_of_the_text() -> None:
    flat = flat_model(MANY, "Many")
    kinds = [[type(statement) for statement in algorithm.body] for algorithm in flat.algorithms]
    assert kinds[0][:3] == [e.Assign, e.IfStatement, e.For]
    assert kinds[1] == [e.WhenClause, e.Assert]
    assert len(flat.initial_algorithms) == 1
    assert flat.whens == ()
    lines = MANY.splitlines()
    places = [algorithm.place for algorithm in flat.algorithms]
    assert [place and lines[place.line - 1].strip() for place in places] == ["algorithm", "algorithm"]


FILLED = """
model Filled "arrays of Integer literals, which become Real"
  function halves
    input Real u;
    output Real r[3];
  protected
    Real w[3] = {1, 0, 0};
  algorithm
    r := {0, 0, 0};
    for i in 1:3 loop
      w[i] := w[i] + u;
      r[i] := w[i] / 2;
    end for;
  end halves;
  Real y[3], column[2], whole[2, 2], z[3] = halves(time), known[3] = halves(0.3);
algorithm
  y := {1, 2, 3};
  for i in 1:3 loop
    y[i] := y[i] / 2 + time;
  end for;
  column := {0, 0};
  whole := {{1, 2}, {3, 4}};
  if time > 0.25 then
    column[2] := time;
    whole[2, :] := {time, 0.75};
  end if;
end Filled;
"""


def test_arrays_of_integers_become_real() -> None:
    final = simulate(load(FILLED, "Filled"), 0.3, save="end").final
    assert np.allclose(final.y, [0.8, 1.3, 1.8])
    assert np.allclose(final.z, [0.65, 0.15, 0.15])
    assert np.allclose(final.known, final.z)
    assert np.allclose(final.column, [0.0, 0.3])
    assert np.allclose(final.whole, [[1.0, 2.0], [0.3, 0.75]])


RECORDS = """
package P
  record V Real a, b, c; end V;
  record W V v; Real z, r[2]; end W;
  record One Real a; end One;
  function f input Real x; output V o; algorithm o.a := x; o.b := 2 * x; o.c := 3 * x; end f;
  function g input Real x; output Real b, c; algorithm b := 10 * x; c := 20 * x; end g;
  function h input V v; output Real y; algorithm y := v.a + v.b + v.c; end h;
  function one input Real x; output One o; algorithm o.a := x; end one;
  function several
    input Real x; output W o; output Real y;
  algorithm
    o.v := f(x); o.z := 5 * x; o.r := {x, -x}; y := 7 * x;
  end several;
  model Fields V v; algorithm v := f(time); (v.b, v.c) := g(v.a); end Fields;
  model Known V v; parameter V p = f(2); algorithm v := p; end Known;
  model Nested W w; Real y; V v; algorithm (w, y) := several(time); v := w.v; end Nested;
  model Branches V v; algorithm if time > 0.5 then v := f(time); else v := f(-time); end if; end Branches;
  model Event V v; algorithm when time > 0.5 then v := f(time); end when; end Event;
  model Read V v; Real y, z; algorithm v := f(time); y := h(v); v.a := 100; z := h(v); end Read;
  model Single One v; algorithm v := one(time); end Single;
  model Twice V v; algorithm v := f(time); v := f(v.b); end Twice;
  model All
    Fields fields; Known known; Nested nested; Branches branches; Event event; Read read; Single single; Twice twice;
  end All;
end P;
"""


@pytest.mark.thorough
def test_algorithms_assign_whole_records() -> None:
    solution = simulate(load(RECORDS, "P.All"), 1.0)

    def end(name: str) -> list[float]:
        return [float(solution[f"{name}.{field}"][-1]) for field in "abc"]

    assert end("fields.v") == [1.0, 10.0, 20.0]
    assert end("known.v") == [2.0, 4.0, 6.0]
    assert end("nested.w.v") == end("nested.v") == end("branches.v") == [1.0, 2.0, 3.0]
    assert [solution[name][-1] for name in ("nested.w.z", "nested.y")] == [5.0, 7.0]
    assert solution["nested.w.r"][-1].tolist() == [1.0, -1.0]
    assert end("event.v") == pytest.approx([0.5, 1.0, 1.5])
    assert [solution[name][-1] for name in ("read.y", "read.z")] == [6.0, 105.0]
    assert end("read.v") == [100.0, 2.0, 3.0]
    assert solution["single.v.a"][-1] == 1.0
    assert end("twice.v") == [2.0, 4.0, 6.0]


ROOTED = """
model Rooted
  parameter Real a = 3;
  Real x(start = 0, fixed = true), y(start = 1);
equation
  der(x) = y;
  y + P.root(y) = 2 * a "y = 4 at a = 3";
end Rooted;
"""


def test_a_loop_of_unknown_length_in_simultaneous_equations_has_derivatives_in_both_modes() -> None:
    model = load(CONTINUOUS + ROOTED, "Rooted")

    def end(a: Any) -> Any:
        return simulate(replace(model, {"a": a}), 1.0, save="end")["x"][-1]

    assert_allclose(end(3.0), 4.0, rtol=1e-9)
    for derivative in (jax.grad(end), jax.jacfwd(end)):
        assert_allclose(derivative(3.0), 2.0 / (1.0 + 0.5 / 2.0), rtol=1e-6)  # of y + sqrt(y) = 2 a


def test_variables_of_algorithms_begin_at_their_start_values() -> None:
    text = """
model M
  parameter Real s = 3;
  Real y(start = s), v[3](start = {1, 2, 3}), w[2](each start = 2);
  parameter Real p(start = 4, fixed = false), q[2](start = {5, 6}, each fixed = false);
initial algorithm
  p := p + 1;
  q[1] := q[2] * 2;
algorithm
  y := y + time;
algorithm
  v[2] := 10 * v[1] + time;
  w[1] := w[1] + w[2];
end M;"""
    final = simulate(load(text, "M"), 0.5, save="end").final
    assert float(final.y) == 3.5
    assert (final.v.tolist(), final.w.tolist()) == ([1.0, 10.5, 3.0], [4.0, 2.0])
    assert (float(final.p), final.q.tolist()) == (5.0, [12.0, 6.0])
