"""Equations of loops: each of them, whatever their number, and for all forms of the ranges and indices."""

import numpy as np
import pytest

from acausal import replace, simulate
from acausal.modelica import load

N = 5
INDEX = np.arange(1.0, N + 1.0)
LOOP = """
model Loop
  parameter Integer n = 5;
  parameter Real k = 1;
  parameter Real c[n] = {10 * j for j in 1:n};
  Real x[n](each start = 0, each fixed = true), y[n];
equation
  y = k * c;
  BODY
end Loop;
"""
BODIES = {
    "for i in 1:n loop der(x[i]) = k * i; end for;": INDEX,
    "for i in 1:n loop 0 = y[i] - c[i] * der(x[i]); end for;": np.ones(N),
    "for i in n:-1:1 loop -der(x[i]) = c[i] - i; end for;": -9.0 * INDEX,
    "der(x[1]) = 0; for i in 2:n - 1 loop der(x[i]) = c[i - 1] + c[i + 1]; end for; der(x[n]) = 1;": [0, 40, 60, 80, 1],
    "for i in 1:2:n loop der(x[i]) = i; end for; for i in 2:2:n loop der(x[i]) = -i; end for;": [1, -2, 3, -4, 5],
    "for i in 1:n loop der(x[n + 1 - i]) = sum(c[1:i]); end for;": np.cumsum(10.0 * INDEX)[::-1],
    "for i in 1:n loop der(x[i]) = sum(j * k for j in 1:i); end for;": np.cumsum(INDEX),
    "for i in 1:n loop der(x[i]) = sum(y[j] * k for j in 1:n); end for;": 150.0 * np.ones(N),
    "for i in 1:n loop der(x[i]) = if i == 1 then 7 else c[i - 1]; end for;": [7, 10, 20, 30, 40],
    "for i in 1:n loop if i < 3 then der(x[i]) = k; else der(x[i]) = -k; end if; end for;": [1, 1, -1, -1, -1],
}
GRID = """
package Grids
  model Grid
    parameter Integer n = 3, m = 4;
    Real x[n, m](each start = 0, each fixed = true), i = 3;
  equation
    for i in 1:n, j in 1:m loop
      der(x[i, j]) = i + 10 * j;
    end for;
  end Grid;
  model Grids
    Grid grid[2](n = {2, 4});
    Real first = sum(grid[1].x), second = sum(grid[2].x);
  end Grids;
end Grids;
"""
WALL = """
model Wall "Conduction along a rod between two temperatures"
  parameter Integer n = 20;
  Real T[n](each start = 0, each fixed = true), q[n + 1];
equation
  q[1] = 2 * (1 - T[1]);
  for i in 2:n loop
    q[i] = T[i - 1] - T[i];
  end for;
  q[n + 1] = 2 * T[n];
  for i in 1:n loop
    der(T[i]) = q[i] - q[i + 1];
  end for;
end Wall;
"""


@pytest.mark.parametrize("body", BODIES)
def test_each_equation_of_a_loop(body: str) -> None:
    solution = simulate(load(LOOP.replace("BODY", body), "Loop"), 1.0, save="end")
    np.testing.assert_allclose(solution["x"][-1], BODIES[body], rtol=1e-9, atol=1e-12)


def test_loops_with_two_indices_in_components() -> None:
    """An index hides a variable of its name."""
    solution = simulate(load(GRID, "Grids.Grid"), 1.0, save="end")
    np.testing.assert_allclose(solution["x"][-1], np.arange(1, 4)[:, None] + 10.0 * np.arange(1, 5), rtol=1e-9)
    solution = simulate(load(GRID, "Grids.Grids"), 1.0, save="end")
    assert solution["first"][-1] == pytest.approx(212.0)
    assert solution["second"][-1] == pytest.approx(440.0)


def test_a_rod_of_volumes_becomes_a_straight_line() -> None:
    solution = simulate(load(WALL, "Wall"), 5000.0, save="end", rtol=1e-9)
    np.testing.assert_allclose(solution["T"][-1], 1.0 - (np.arange(20) + 0.5) / 20.0, atol=1e-8)


OUTER = """
package Outers
  model System
    parameter Real g = 1;
    parameter Real c[4] = {1, 2, 3, 4};
  end System;
  model Part
    outer System system;
    Real x[4];
  initial equation
    for i in 1:4 loop
      der(x[i]) = system.g * i - x[i];
    end for;
  equation
    for i in 1:4 loop
      der(x[i]) = system.g * system.c[i];
    end for;
  end Part;
  model Whole
    inner System system(g = 3, c = {4, 3, 2, 1});
    Part part;
  end Whole;
end Outers;
"""


def test_a_loop_reads_the_values_of_an_inner_component() -> None:
    """The start follows from g i - x = g c and the rate is g c."""
    model = load(OUTER, "Outers.Whole")
    rate = lambda g: g * np.array([4.0, 3.0, 2.0, 1.0])  # noqa: E731
    for found, g in ((model, 3.0), (replace(model, {"system.g": 5.0}), 5.0)):
        solution = simulate(found, 1.0, save=[0.0, 1.0])
        np.testing.assert_allclose(solution["part.x"][-1], g * INDEX[:4], rtol=1e-9)
        np.testing.assert_allclose(solution["part.x"][0], g * INDEX[:4] - rate(g), rtol=1e-9, atol=1e-12)


INITIAL = """
model Initial
  parameter Real k = 2;
  Real x[4], y;
initial algorithm
  for i in 1:4 loop
    x[i] := k * i ^ 2;
  end for;
  y := sum(x);
equation
  der(x) = zeros(4);
  der(y) = 1;
end Initial;
"""


def test_an_initial_algorithm_determines_states() -> None:
    solution = simulate(load(INITIAL, "Initial"), 1.0, save="end")
    np.testing.assert_allclose(solution["x"][-1], 2.0 * INDEX[:4] ** 2, rtol=1e-9)
    assert solution["y"][-1] == pytest.approx(61.0)


SIZES = """
package Sizes
  record Counts
    Integer n[2] = {2, 3};
  end Counts;
  function second
    input Integer a[:];
    output Integer y;
  algorithm
    y := a[2];
  end second;
  model Part
    parameter Integer n = 1;
    Real x[n](each start = 0, each fixed = true), total = sum(x);
  equation
    for i in 1:n loop
      der(x[i]) = 1;
    end for;
  end Part;
  model Whole
    parameter Integer k = 2, ns[2] = {2, 3};
    parameter Boolean large[2] = {false, true};
    parameter Counts counts;
    Part part(n = VALUE);
  end Whole;
end Sizes;
"""


@pytest.mark.parametrize(
    ("value", "n"),
    [
        ("ns[2]", 3), ("ns[k] + 1", 4), ("sum(ns)", 5), ("max(ns)", 3), ("counts.n[2]", 3), ("second(ns)", 3),
        ("ns * ns", 13), ("if large[2] then 3 else 2", 3), ("size(ns, 1)", 2), ("k + 1", 3),
    ],
)  # fmt: skip
def test_sizes_that_a_modifier_takes_from_arrays(value: str, n: int) -> None:
    solution = simulate(load(SIZES.replace("VALUE", value), "Sizes.Whole"), 1.0, save="end")
    assert solution["part.total"][-1] == pytest.approx(float(n))


def test_a_size_that_a_final_modifier_takes_from_an_array() -> None:
    text = SIZES.replace("n = VALUE", "final n = ns[2]")
    assert simulate(load(text, "Sizes.Whole"), 1.0, save="end")["part.total"][-1] == pytest.approx(3.0)


def test_sizes_and_ranges_of_declarations_from_arrays() -> None:
    declared = "Part part[ns[k] + 1](each n = 2); Real y[3];"
    body = "equation for i in 1:ns[2] loop y[i] = i; end for;"
    text = SIZES.replace(
        "Part part(n = VALUE);", f"final parameter Integer m = ns[2]; Part final_part[m]; {declared} {body}"
    )
    final = simulate(load(text, "Sizes.Whole"), 1.0, save="end")
    assert [final[f"part[{i}].total"][-1] for i in (1, 2, 3, 4)] == pytest.approx([2.0] * 4)
    assert final["final_part[3].total"][-1] == pytest.approx(1.0)
    np.testing.assert_allclose(final["y"][-1], [1.0, 2.0, 3.0])


def test_a_range_in_a_function_may_read_an_array() -> None:
    body = "algorithm y := 0; for i in 1:a[1] loop y := y + i; end for;"
    text = SIZES.replace("algorithm\n    y := a[2];", body).replace("n = VALUE", "n = second(ns)")
    assert simulate(load(text, "Sizes.Whole"), 1.0, save="end")["part.total"][-1] == pytest.approx(3.0)
