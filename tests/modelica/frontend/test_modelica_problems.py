"""All problems of a model are listed at once, each place once."""

import pytest
from flat_text import flat

from acausal.modelica import ModelicaError


def places(text: str, model: str = "M") -> list[str]:
    """Line and message of each problem."""
    with pytest.raises(ModelicaError) as found:
        flat(text, model)
    lines = str(found.value).splitlines()
    assert len(lines) % 3 == 0
    assert all(line.strip() == "^" for line in lines[2::3])
    return [line.removeprefix("<model>.mo:") for line in lines[::3]]


CLASSES = """package P
  connector Pin Real v; flow Real i; end Pin;
  connector Flange Real phi; flow Real tau; end Flange;
  model Part
    Pin p;
    Raal x;
  end Part;
  model Base
    extends Missing;
    Real y = 1;
  end Base;
  model M
    Part part[2], other(k = 2);
    Base base;
    Pin p;
    Flange f;
    Real z(stat = 1);
    Real z2 if unknown;
  equation
    connect(p, f);
    connect(p, q);
  end M;
end P;
"""


def test_all_problems_of_classes_and_connections() -> None:
    found = places(CLASSES, "P.M")
    assert [line.partition(":")[0] for line in found] == ["6", "13", "9", "17", "18", "20", "21"]
    assert "no class Raal" in found[0]
    assert "Part has no element k to modify" in found[1]


EQUATIONS = """model M
  parameter Integer n = 2.5;
  parameter Real a[2] = {1, 2, 3};
  Real x[2], y;
  Boolean b;
equation
  x = time;
  b = y + 1;
  y = 1 / undeclared;
  for i in 1:3 loop
    x[i] = b;
  end for;
algorithm
  y := b;
  y := 1;
  n := 2;
end M;
"""


def test_all_problems_of_values_equations_and_statements() -> None:
    lines = [line.partition(":")[0] for line in places(EQUATIONS)]
    assert lines == ["2", "3", "7", "8", "9", "11", "14", "16"]


def test_an_error_while_a_value_is_calculated_has_the_place_of_the_equation() -> None:
    text = """model M
  function f input Real x; output Real y; algorithm assert(x > 0, "x is negative"); y := x; end f;
  parameter Real k = -1;
  Real y, z[2];
equation
  if f(k) > 0 then
    y = 1;
  else
    y = 2;
  end if;
  z = time;
end M;
"""
    first, second = places(text)
    assert first.startswith("6:")
    assert "x is negative" in first
    assert second.startswith("11:")
