"""Vectors of conditions and of scalars, names like those of `pre`, and roots of what may become negative."""

from typing import Any

import numpy as np
import pytest

from acausal import ModelError, SimulationError, replace, simulate, structure
from acausal.modelica import load

TEXT = """
model Draining
  Boolean b[2], pre_b[2], first, second;
  Boolean none[0];
  Integer count(start = 0, fixed = true), never(start = 0, fixed = true);
  Real level(start = 1, fixed = true);
equation
  b = {time > 0.3, time > 0.8};
  pre_b = pre(b);
  {first, second} = fill(b[1], 2);
  when b then
    count = pre(count) + 1;
  end when;
  when none then
    never = pre(never) + 1;
  end when;
  der(level) = -1 - sqrt(max(0, level));
end Draining;
"""


def test_vectors_and_roots() -> None:
    times = np.array([0.1, 0.5, 0.9])
    solution = simulate(load(TEXT, "Draining"), 0.9, save=times, rtol=1e-9)
    assert solution["count"].tolist() == [0, 1, 2]  # each of the conditions counts
    assert solution["never"].tolist() == [0, 0, 0]
    assert solution["first"].tolist() == solution["second"].tolist() == [0, 1, 1]
    assert solution["pre_b"].tolist() == [[0, 0], [1, 0], [1, 1]]
    # The root u of the level obeys 2 u u' = -1 - u, so that the level is 0 at 2 (1 - ln 2), and then falls linearly.
    assert np.isclose(solution["level"][-1], 2 * (1 - np.log(2)) - 0.9, atol=1e-7)


PLACES = """model Places
  parameter Integer n = {n};
  parameter Real late = 9;
  Real a[2], y, x(start = 1, fixed = true);
  Integer k;
equation
  der(x) = 1;
  a = {{x, 2 * x}};
  k = if time > late then 3 else 2;
  y = a[n] + a[k] + (if k > 2 then 0 else a[k - 1]);
end Places;
"""


def test_a_subscript_out_of_bounds_is_named() -> None:
    for n in (0, 3):
        with pytest.raises(ModelError, match=rf"mo:10:9: the subscript {n} is out of bounds: the size is 2"):
            simulate(load(PLACES.format(n=n), "Places"), 1.0)


def test_an_element_out_of_bounds_is_not_a_number() -> None:
    model: Any = load(PLACES.format(n=1), "Places")
    assert np.isclose(simulate(model, 1.0, save="end")["y"][-1], 8.0)
    with pytest.raises(SimulationError, match="not a number"):
        simulate(replace(model, {"late": 0.5}), 1.0)


def test_an_element_depends_on_no_other() -> None:
    """The first element of {x, der(u)} is x, so that the equations form no loop."""
    text = """
    model M
      function first
        input Real v[2, 2];
        output Real y;
      algorithm
        y := v[1, 1];
      end first;
      Real x(start = 1, fixed = true), rate, u;
    equation
      rate = der(x);
      u = first({{x, rate}, {rate, rate}});
      der(x) = -u;
    end M;
    """
    model = load(text, "M")
    assert "none of them simultaneous" in str(structure(model))
    assert simulate(model, 1.0, save="end", rtol=1e-8)["x"][-1] == pytest.approx(np.exp(-1.0))


@pytest.mark.parametrize("equation", ["x = {time, 2};", "x = time;", "x = {{i * j for i in 1:2} for j in 1:3};"])
def test_sides_of_different_shapes_are_refused(equation: str) -> None:
    text = f"model Shapes\n  Real x[2, 2];\nequation\n  {equation}\nend Shapes;"
    with pytest.raises(ModelError, match=r"mo:4:3: the sides of the equation have different sizes: \[2, 2\]"):
        simulate(load(text, "Shapes"), 1.0)


SLICES = """model Slices
  function swapped
    input Real a[:, :];
    output Real y[3, 3] = zeros(3, 3);
  algorithm
    y[{1, 3}, {3, 1}] := a;
    y[2, {1, 2}] := {5, 6};
    y[{2, 3}, :] := y[{3, 2}, :];
  end swapped;
  parameter Real known[3, 3] = swapped({{1, 2}, {3, 4}});
  Real varying[3, 3] = swapped({{time, 2}, {3, 4}}), part[2, 2] = varying[{3, 1}, {2, 3}];
end Slices;
"""


def test_vectors_of_subscripts_count_for_their_own_axes() -> None:
    solution: Any = simulate(load(SLICES, "Slices"), 1.0, save="end")
    expected = np.array([[2.0, 0.0, 1.0], [4.0, 0.0, 3.0], [5.0, 6.0, 0.0]])
    np.testing.assert_allclose(solution["known"], expected)
    np.testing.assert_allclose(solution["varying"][-1], expected)
    np.testing.assert_allclose(solution["part"][-1], expected[np.ix_([2, 0], [1, 2])])


POWERS = """package P
  function squared input Real a[:, :]; output Real b[size(a, 1), size(a, 2)]; algorithm b := a .^ 2; end squared;
  model M
    constant Real c[2, 2] = [2, 1; 1, 3] .^ 2;
    parameter Real p[2, 2] = [2, 1; 1, 3];
    parameter Real q[2, 2] = p .^ 2, r[2, 2] = p ^ 2;
    Real x(start = 0, fixed = true), e[2, 2] = (p * x) .^ 2, m[2, 2] = (p * x) ^ 2, f[2, 2] = squared(p * x);
    Real k[2, 2] = c + zeros(2, 2), g[2, 2] = 2 .^ (p * x), s[2, 2];
  equation
    der(x) = 1;
  algorithm
    s := (p * x) .^ p;
  end M;
end P;
"""


def test_a_power_by_elements_of_a_square_matrix_is_no_product() -> None:
    solution = simulate(load(POWERS, "P.M"), 1.0, save="end")
    p = np.array([[2.0, 1.0], [1.0, 3.0]])
    expected = {"k": p**2, "q": p**2, "r": p @ p, "e": p**2, "m": p @ p, "f": p**2, "g": 2**p, "s": p**p}
    for name, value in expected.items():
        found = solution[name]
        assert np.allclose(found[-1] if np.ndim(found) > 2 else found, value), name


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ("[v, 2 * v, [3 * v]]", [[1.0, 2.0, 3.0], [2.0, 4.0, 6.0]]),
        ("[v; v; 7]", [[1.0], [2.0], [1.0], [2.0], [7.0]]),
        ("[[v, v]; transpose([{4, 5}])]", [[1.0, 1.0], [2.0, 2.0], [4.0, 5.0]]),
        ("cat(2, [v, v], [v])", [[1.0, 1.0, 1.0], [2.0, 2.0, 2.0]]),
    ],
)
def test_matrices_of_vectors_whose_size_depends_on_the_call(value: str, expected: list[list[float]]) -> None:
    text = f"""
    function f input Real v[:]; output Real a[:, :] = {value}; algorithm end f;
    model M Real x[{len(expected)}, {len(expected[0])}] = f({{time, 2 * time}}); end M;
    """
    assert np.allclose(simulate(load(text, "M"), 1.0)["x"][-1], expected)


def test_an_equation_of_matrices_determines_vectors_of_truths() -> None:
    text = "model M Boolean b[2], c[2] = {time > 0.5, time < 0.5}; Integer n = if b[1] then 1 else 2; "
    solution = simulate(load(text + "equation [b] = [c]; end M;", "M"), 1.0, save=np.array([0.2, 0.8]))
    assert solution["b"].tolist() == [[0, 1], [1, 0]]
    assert solution["n"].tolist() == [2, 1]
