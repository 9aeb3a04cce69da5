"""Parameters of records select equations, components, sizes and ranges by the values that modifiers give them."""

from typing import Any

import jax
import pytest
from numpy.testing import assert_allclose

from acausal import parameters, replace, simulate
from acausal.modelica import load
from acausal.modelica._translate.functions import Library

TEXT = """
package P
  record Q parameter Integer m = 2; parameter Boolean on = false; end Q;
  record On = Q(m = 3, on = true);
  function made
    output Q q = Q(m = 3, on = true);
    algorithm
  end made;
  model Part parameter Real y = 1; end Part;
  model B
    Q q;
    Part p[q.m];
    Part present if q.on;
    Part absent if not q.on;
    Real z[3], w;
  equation
    for i in 1:q.m loop
      z[i] = i;
    end for;
    if q.m < 3 then
      z[3] = 7;
    end if;
    if q.on then
      w = 1;
    end if;
    if not q.on then
      w = 3;
    end if;
  end B;
  model Around parameter Q d; B b(q = d); end Around;
  model Nested parameter Q d; final parameter Boolean u = d.on; B b(final q(on = u, m = d.m)); end Nested;
  model Whole
    DECLARED
  end Whole;
end P;
"""
ON = (3, True, [1.0, 2.0, 3.0], 1.0)
OFF = (2, False, [1.0, 2.0, 7.0], 3.0)


@pytest.mark.parametrize(
    ("declared", "expected"),
    [
        ("B b;", {"b": OFF}),
        ("B b(q(m = 3, on = true));", {"b": ON}),
        ("B b(q = Q(m = 3, on = true));", {"b": ON}),
        ("constant Q c = Q(3, true); B b(q = c);", {"b": ON}),
        ("parameter Q c(m = 3, on = true); B b(q = c);", {"b": ON}),
        ("parameter Q c(m = 3, on = true); B b(final q = c);", {"b": ON}),
        ("parameter On c; B b(q = c);", {"b": ON}),
        ("B b(q = On());", {"b": ON}),
        ("B b(q = made());", {"b": ON}),
        ("parameter Boolean u = true; B b(q = if u then On() else Q());", {"b": ON}),
        ("parameter Q c[2](m = {2, 3}, on = {false, true}); B b[2](q = c);", {"b[1]": OFF, "b[2]": ON}),
        ("parameter Q c[2] = {Q(3, true), Q(2, false)}; B b[2](q = c);", {"b[1]": ON, "b[2]": OFF}),
        ("parameter Q c[2] = {Q(2, false), Q(3, true)}; B b(q = c[2]);", {"b": ON}),
        ("B b[2](q = {Q(2, false), Q(3, true)});", {"b[1]": OFF, "b[2]": ON}),
        ("Around a(d(m = 3, on = true));", {"a.b": ON}),
        ("Around a(d = Q(m = 3, on = true)), b;", {"a.b": ON, "b.b": OFF}),
        ("Nested a(d = Q(m = 3, on = true));", {"a.b": ON}),
    ],
)
def test_the_value_of_a_field_selects(declared: str, expected: dict[str, tuple[int, bool, list[float], float]]) -> None:
    model = load(TEXT.replace("DECLARED", declared), "P.Whole")
    solution = simulate(model, 1.0, save="end")
    for name, (m, on, z, w) in expected.items():
        members = {path for path in parameters(model) if path.startswith(f"{name}.")}
        assert members == {f"{name}.p[{i}].y" for i in range(1, m + 1)} | {f"{name}.{'present' if on else 'absent'}.y"}
        assert_allclose(solution[f"{name}.z"][-1], z)
        assert solution[f"{name}.w"][-1] == w


MADE = """package Made
  record Inner parameter Integer m = 2; Real a; end Inner;
  record Outer Inner core; parameter Real k = 1; Real b; end Outer;
  function made
    input Real x;
    output Outer y = Outer(Inner(3, 2 * x), 7, 6 * x);
    algorithm
  end made;
  model Whole
    parameter Real p = 1;
    Outer y = made(p);
    Real s[y.core.m], sum;
  equation
    for i in 1:y.core.m loop
      s[i] = i * y.core.a;
    end for;
    sum = y.core.m + y.k + y.b;
  end Whole;
end Made;
"""


def test_parameters_among_the_fields_of_a_record_have_the_values_of_the_call() -> None:
    solution = simulate(load(MADE, "Made.Whole"), 0.0, save="end")
    assert_allclose(solution["s"][-1], [2.0, 4.0, 6.0])
    assert solution["sum"][-1] == 3 + 7 + 6


CALLED = """package Called
  record Data
    Real a, b, c, d;
  end Data;
  function made
    input Real k;
    output Data y;
  algorithm
    y := Data(k, 2 * k, 3 * k, 4 * k);
  end made;
  model Whole
    parameter Real k = 2;
    parameter Data data = made(k);
    Real x(start = data.d, fixed = true);
  equation
    der(x) = -data.a;
  end Whole;
end Called;
"""


def test_a_call_that_gives_a_record_is_evaluated_once_for_all_its_fields(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[str] = []
    original = Library._results

    def counted(self: Library, function: Any, given: Any) -> Any:
        calls.append(function.name)
        return original(self, function, given)

    monkeypatch.setattr(Library, "_results", counted)
    model = load(CALLED, "Called.Whole")
    assert calls.count("Called.made") == 1
    assert [float(getattr(model.data, name)) for name in "abcd"] == [2.0, 4.0, 6.0, 8.0]
    slope = jax.grad(lambda k: simulate(replace(model, {"k": k}), 1.0, save="end")["x"][-1])
    assert slope(2.0) == pytest.approx(3.0)
