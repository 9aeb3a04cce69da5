"""Functions with several results, or none, in when-clauses and initial equations."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from acausal import SimulationError, simulate
from acausal.modelica import ModelicaError, load

TEXT = """
model M
  function sums
    input Real x[:];
    output Real doubled[size(x, 1)];
    output Real total;
  algorithm
    doubled := if x[1] > 0.1 then 2*x else x;
    total := sum(x);
  end sums;
  function empty
    input Real x;
    output Real none[0], same;
  algorithm
    none := zeros(0);
    same := x;
  end empty;
  record Part
    parameter Real none[0](each fixed = false), same(fixed = false);
  end Part;
  function inverse
    input Real x[:];
    output Real y[size(x, 1)];
    output Real first;
  algorithm
    y := ones(size(x, 1)) ./ x;
    first := sqrt(x[1] - 1)/x[1];
  end inverse;
  discrete Real a[2](start = {1, 2}, each fixed = true);
  discrete Real b(start = 1, fixed = true);
  parameter Real p[2](each fixed = false), q(fixed = false), r[2](each fixed = false), s(fixed = false);
  parameter Real u[2](each fixed = false, each start = 1);
  Real x[2](each start = 0, each fixed = true);
  Part part;
initial equation
  (part.none, part.same) = empty(7);
  (p, q) = sums({2, 3});
  (r, s) = inverse(p);
  u .^ 2 = 4*p;
equation
  when sample(0.5, 1) then
    (a, b) = sums(pre(a));
  end when;
  der(x) = r;
end M;
"""


def test_all_results_count_in_when_clauses_and_initial_equations() -> None:
    end = simulate(load(TEXT, "M"), 2.0, save="end", rtol=1e-8)
    assert_allclose(end["a"][-1], [4, 8])
    assert_allclose(end["b"][-1], 6)
    assert_allclose(end["x"][-1], 2 / np.array([4, 6]), rtol=1e-8)
    assert_allclose([end["q"][-1], end["s"][-1]], [5, np.sqrt(3) / 4])
    assert_allclose(end["part.same"][-1], 7)
    assert_allclose(end["u"][-1], [4, np.sqrt(24)])


def test_calls_without_results_in_when_clauses_print_or_fail() -> None:
    text = """
    model M
      function show input String s; external "C" ModelicaInternal_print(s); end show;
      function check input Real x; algorithm show("checked"); assert(x < limit, "x is large"); end check;
      constant Real limit = 0.75;
      Real x(start = 0, fixed = true);
    equation
      der(x) = 1;
      when sample(0.5, 0.5) then
        check(x);
      end when;
    end M;
    """
    model = load(text, "M")
    assert_allclose(simulate(model, 0.9, save="end")["x"][-1], 0.9)
    with pytest.raises(SimulationError, match=r"At t = 1 s: .*x is large"):
        simulate(model, 1.5)


CHOSEN = """
model M
  function both
    input Real x;
    output Real once, twice;
  algorithm
    once := x;
    twice := 2*x;
  end both;
  discrete Real a(start = 0, fixed = true), b(start = 0, fixed = true);
  Real c, d, e;
equation
  when time > 0.25 then
    (, a) = both(time);
    b = both(time);
  end when;
  if time > 0.5 then
    (c, d) = both(time);
  else
    (c, d) = both(-time);
  end if;
  e = if time > 0.5 then both(time) else 3;
end M;
"""


def test_results_are_chosen_one_by_one() -> None:
    """A result may be dropped, and in an expression the first one counts."""
    solution = simulate(load(CHOSEN, "M"), 1.0, save=np.array([0.4, 0.8]))
    found = [solution[name] for name in "abcde"]
    assert_allclose(found, [[0.5, 0.5], [0.25, 0.25], [-0.4, 0.8], [-0.8, 1.6], [3, 0.8]])
    with pytest.raises(ModelicaError, match="give results to different variables"):
        load(CHOSEN.replace("(c, d) = both(-time)", "(d, c) = both(-time)"), "M")
