"""`pre`, and when-clauses that become active at the same instant (Modelica 3.6, sections 3.7.5, 8.3.5, 8.5 and 8.6)."""

from typing import Any

import jax
import numpy as np
import pytest

from acausal import replace, simulate
from acausal.modelica import load

DELAYS = """
package Delays
  block UnitDelay
    input Real u;
    output Real y(start = 0, fixed = true);
  equation
    when sample(0.1, 0.1) then
      y = pre(u);
    end when;
  end UnitDelay;

  model Chain
    UnitDelay c, a, d, b;
    Real u = if time >= 0.2 then 2 else 1;
  equation
    d.u = c.y;
    b.u = a.y;
    a.u = u;
    c.u = 2 * b.y;
  end Chain;
end Delays;
"""


def test_unit_delays_in_series_delay_by_one_sample_each() -> None:
    """The input jumps at a tick. The delay reads its left limit."""
    t = np.arange(0.05, 0.7, 0.1)
    sol = simulate(load(DELAYS, "Delays.Chain"), 0.7, save=t)
    u = np.array([0, 1, 1, 2, 2, 2, 2])  # of the first delay, as shifted below
    assert np.array_equal(sol["a.y"], u)
    assert np.array_equal(sol["b.y"], np.append([0], u)[:7])
    assert np.array_equal(sol["c.y"], 2 * np.append([0, 0], u)[:7])
    assert np.array_equal(sol["d.y"], 2 * np.append([0, 0, 0], u)[:7])


TOGETHER = """
model Together
  Integer n(start = 0), late(start = 0), before(start = 0), now(start = 0);
  Real twice(start = 0), base(start = 0), left(start = 0), right(start = 0), earlier(start = 0), old(start = 0);
  Real x(start = 0, fixed = true), w, passed;
equation
  der(x) = 1;
  w = x + twice;
  passed = base;
  when sample(0.1, 0.1) then
    n = pre(n) + 1;
  elsewhen time >= 0.2 then
    n = pre(n) + 100;
  end when;
  when time >= 0.3 then
    late = n;
  end when;
  when n > 2 then
    before = pre(n);
    now = n;
  end when;
  when sample(0.1, 0.1) then
    twice = 2 * passed;
  end when;
  when sample(0.1, 0.2) then
    base = time;
  end when;
  when sample(0.1, 0.1) then
    left = pre(w);
    right = w;
    earlier = pre(left);
  end when;
  when time >= 0.4 then
    old = pre(x);
    reinit(x, 0);
  end when;
end Together;
"""


def test_simultaneous_when_clauses_are_one_system() -> None:
    """The first branch has priority over the second one, and clauses read what others set at the instant."""
    t = np.arange(0.05, 0.6, 0.1)
    sol = simulate(load(TOGETHER, "Together"), 0.6, save=t)
    assert np.array_equal(sol["n"], [0, 1, 2, 3, 4, 5])
    assert np.array_equal(sol["late"], [0, 0, 0, 3, 3, 3])
    assert np.array_equal(sol["before"], [0, 0, 0, 2, 2, 2])
    assert np.array_equal(sol["now"], [0, 0, 0, 3, 3, 3])
    assert np.allclose(sol["base"], [0, 0.1, 0.1, 0.3, 0.3, 0.5])
    assert np.allclose(sol["twice"], 2 * sol["base"])
    assert np.allclose(sol["left"], [0, 0.1, 0.4, 0.5, 1.0, 0.7])
    assert np.allclose(sol["right"], [0, 0.3, 0.4, 0.9, 1.0, 1.1])
    assert np.allclose(sol["earlier"], np.append([0], sol["left"])[:6])
    assert np.allclose(sol["old"], [0, 0, 0, 0, 0.4, 0.4])


HELD = """
model Held
  parameter Real T = 0.3;
  Real x(start = 1, fixed = true), w, y(start = 0, fixed = true);
equation
  der(x) = -x;
  w = x ^ 2 + (if time > 5 then 1 else 0);
  when time > T then
    y = pre(w);
  end when;
end Held;
"""


@pytest.mark.thorough
def test_derivatives_of_a_left_limit_by_its_time() -> None:
    model = load(HELD, "Held")

    def value(T: float) -> jax.Array:
        return simulate(replace(model, {"T": T}), 1.0, rtol=1e-10, save="end").final.y

    assert value(0.3) == pytest.approx(np.exp(-0.6), rel=1e-8)
    assert jax.jacfwd(value)(0.3) == pytest.approx(-2 * np.exp(-0.6), rel=1e-7)
    assert jax.grad(value)(0.3) == pytest.approx(-2 * np.exp(-0.6), rel=1e-7)


ELEMENTS = """model Elements
  discrete Real x[2](each start = 0, each fixed = true);
  Integer n[2];
  Clock c = Clock(0.25);
  Real y[2](each start = 0);
initial equation
  n = {7, 8};
equation
  when time > 0.5 then
    x[1] = 3;
    n[1] = pre(n[1]) + 1;
  end when;
  when time > 0.7 then
    x[2] = pre(x[1]) + 1;
  end when;
  when sample(0.1, 0.2) then
    n[2] = pre(n[2]) + 1;
  end when;
  when c then
    y[1] = previous(y[1]) + 1;
    y[2] = previous(y[1]);
  end when;
end Elements;
"""


def test_clauses_set_elements_of_arrays() -> None:
    solution: Any = simulate(load(ELEMENTS, "Elements"), 0.95, save=[0.0, 0.6, 0.95])
    assert solution["x"].tolist() == [[0.0, 0.0], [3.0, 0.0], [3.0, 4.0]]
    assert solution["n"].tolist() == [[7.0, 8.0], [8.0, 11.0], [8.0, 13.0]]
    assert solution["y"].tolist() == [[1.0, 0.0], [3.0, 2.0], [4.0, 3.0]]
