"""Array constructors with several iterators: the first iterator counts the columns (Modelica 3.6, section 10.4.1.1)."""

import pytest
from numpy.testing import assert_allclose

from acausal import simulate
from acausal.modelica import load

ROWS = [[11.0, 12.0, 13.0], [21.0, 22.0, 23.0]]
EXPRESSIONS = ["{i * 10 + j for j in 1:3, i in 1:2}", "{{i * 10 + j for j in 1:3} for i in 1:n}"]
TEXT = """
package P
  model Part parameter Real k = 0; parameter Real d[2] = {0, 0};
    Real x(start = k, fixed = true), y = k;
  equation
    der(x) = 0;
  end Part;
  model Row Part p[3]; end Row;
  function f input Integer n; output Real a[n, 3]; algorithm a := VALUE; end f;
  model Whole
    parameter Integer n = 2;
    DECLARED
  end Whole;
end P;
"""
PLACES = {
    "Real x[2, 3] = VALUE;": "x",
    "Real x[2, 3]; equation x = VALUE;": "x",
    "Real x[2, 3]; algorithm x := VALUE;": "x",
    "Real x[2, 3] = f(2);": "x",
    "Real x[2, 3](start = VALUE, each fixed = true); equation der(x) = zeros(2, 3);": "x",
    "parameter Real a[2, 3] = VALUE; Real x[2, 3] = time * a;": "x",
    "constant Real a[2, 3] = VALUE; Real x[2, 3] = time * a;": "x",
    "Part p[2, 3](k = VALUE);": "p[{}][{}].y",
    "Part p[2, 3](x(start = VALUE));": "p[{}][{}].x",
    "Row row[2](p(k = VALUE));": "row[{}].p[{}].y",
    "Part p[2, 3](k = x) ; parameter Real x[2, 3] = VALUE;": "p[{}][{}].y",
}


@pytest.mark.parametrize("expression", EXPRESSIONS)
@pytest.mark.parametrize("declared", PLACES)
def test_the_order_of_iterators(declared: str, expression: str) -> None:
    text = TEXT.replace("DECLARED", declared).replace("VALUE", expression)
    solution, name = simulate(load(text, "P.Whole"), 1.0, save="end"), PLACES[declared]
    if "{}" not in name:
        assert_allclose(solution[name][-1], ROWS)
        return
    assert_allclose([[solution[name.format(i, j)][-1] for j in (1, 2, 3)] for i in (1, 2)], ROWS)


def test_a_modifier_of_the_loaded_model() -> None:
    text = TEXT.replace("DECLARED", "Row row[2];").replace("VALUE", EXPRESSIONS[0])
    solution = simulate(load(text, f"P.Whole(row(p(k = {EXPRESSIONS[0]})))"), 1.0, save="end")
    assert [solution[f"row[{i}].p[3].y"][-1] for i in (1, 2)] == [13.0, 23.0]


def test_iterators_vary_as_their_range() -> None:
    text = """model M Integer v[3] = if time < 0.5 then {1, 1, 1} else {3, 1, 2}; Integer n = product(i for i in v);
      Integer m = sum(2 * i for i in v); Integer w[3] = {i + 1 for i in v}; Real x(start = 0, fixed = true);
      equation der(x) = 1; end M;"""
    solution = simulate(load(text, "M"), 1.0, save="end")
    assert solution["n"][-1] == 6
    assert solution["m"][-1] == 12
    assert solution["w"][-1].tolist() == [4, 2, 3]
