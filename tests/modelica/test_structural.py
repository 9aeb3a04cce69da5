"""Parameters that select equations, components, sizes and ranges are fixed, whatever their type."""

import re
from collections.abc import Callable
from typing import Any

import jax
import pytest

from acausal import ParameterError, UnknownNameError, parameters, replace, simulate
from acausal.design import Normal, Tolerance, optimise, sweep
from acausal.design import train as trained
from acausal.modelica import load

MODEL = """
package Selects
  type Kind = enumeration(fast, slow);
  record Data
    parameter Real r = 2;
  end Data;
  model Load
    parameter Real y = 1;
  end Load;
  model Part
    parameter Data data;
    parameter Real above = 2 * data.r;
    parameter Real k = 2;
    parameter Real free = 1;
    Real x(start = 1, fixed = true);
  equation
    if above > 1 then
      der(x) = -free * x;
    end if;
    if above <= 1 then
      der(x) = x;
    end if;
  end Part;
  model Whole
    parameter Real real = 2;
    parameter Real upper = 3 * real;
    parameter Integer n = 2;
    parameter Boolean flag = true;
    parameter Kind kind = Kind.fast;
    parameter String name = "a";
    parameter Real size = 2.5, range = 2, present = 1.5, absent = 0.5, state = 0.5, free = 3;
    parameter Boolean starts = state > 0;
    Real a, b, c, d, e, w[integer(size)], v[integer(range)], x(start = 1, fixed = starts);
    parameter Integer m = integer(size);
    Load load if present > 1;
    Load none if absent > 1;
    Load loads[m];
    Part part, parts[2];
  equation
    if upper > 1 then a = free; end if;
    if upper <= 1 then a = 0; end if;
    if n > 1 then b = free; else b = 0; end if;
    if flag then c = free; else c = 0; end if;
    if kind == Kind.fast then d = free; else d = 0; end if;
    if name == "a" then e = free; else e = 0; end if;
    for i in 1:integer(range) loop v[i] = i; end for;
    w = ones(integer(size));
    der(x) = -x;
  end Whole;
end Selects;
"""
FIXED = [
    "real", "upper", "n", "flag", "kind", "name", "size", "range", "present", "absent", "state", "starts",
    "part.data.r", "part.above", "parts[1].data.r", "parts[2].above",
]  # fmt: skip


@pytest.fixture(scope="module")
def whole() -> Any:
    return load(MODEL, "Selects.Whole")


@pytest.mark.parametrize("name", FIXED)
@pytest.mark.parametrize(
    "change",
    [
        lambda model, name: replace(model, {name: 5.0}),
        lambda model, name: jax.grad(lambda value: simulate(replace(model, {name: value}), 1.0)["a"][-1])(5.0),
        lambda model, name: optimise(model, {name: (1.0, 5.0)}, {"a": (lambda m: m.free, "1")}),
        lambda model, name: sweep(model, {name: [1.0, 5.0]}, lambda m: m.free),
        lambda model, name: Tolerance(model, {name: Normal(std=0.1)}, lambda m: m.free),
        lambda model, name: trained(model, [name], lambda m: m.free),
    ],
)
def test_a_parameter_that_selects_is_fixed(whole: Any, name: str, change: Callable[[Any, str], object]) -> None:
    with pytest.raises(ParameterError, match=rf"^{re.escape(name)} is fixed, .*by a modifier when you load"):
        change(whole, name)


def test_other_parameters_are_free(whole: Any) -> None:
    assert set(parameters(whole)) == {
        "free", "load.y", "loads[1].y", "loads[2].y", "part.k", "part.free", "parts[1].k", "parts[1].free",
        "parts[2].k", "parts[2].free",
    }  # fmt: skip
    slope = jax.grad(lambda value: simulate(replace(whole, {"free": value}), 1.0, save="end")["a"][-1])
    assert slope(5.0) == 1.0
    with pytest.raises(UnknownNameError, match=r"has no .*'real'"):
        _ = whole.real


def test_a_modifier_takes_effect() -> None:
    changes = 'real = 0.1, n = 1, flag = false, kind = Selects.Kind.slow, name = "b", size = 1.5, range = 1'
    model = load(MODEL, f"Selects.Whole({changes}, present = 0.5, absent = 2, part(data(r = 0.1)))")
    solution = simulate(model, 1.0, save="end")
    assert [solution[name][-1] for name in "abcde"] == [0.0] * 5
    assert solution["w"].shape == (1, 1)
    assert {name for name in parameters(model) if name.endswith(".y")} == {"none.y", "loads[1].y"}
    assert solution["part.x"][-1] == pytest.approx(2.718281828, rel=1e-6)


def test_a_condition_that_other_parameters_decide_fixes_nothing() -> None:
    text = """model Decided
  model Load parameter Real y = 1; end Load;
  parameter Boolean shown = false;
  parameter Real m = 1;
  Load load if shown and m > 0;
end Decided;"""
    assert "m" in parameters(load(text, "Decided"))
    with pytest.raises(ParameterError, match="m is fixed"):
        replace(load(text, "Decided(shown = true)"), {"m": 2.0})


def test_a_relation_for_fixed_fixes_what_it_reads() -> None:
    text = "model M\n  parameter Real k = 2;\n  Real x(start = 1, fixed = k > 1);\nequation\n  der(x) = 1;\nend M;"
    assert simulate(load(text, "M"), 1.0, save="end")["x"][-1] == pytest.approx(2.0)
    with pytest.raises(ParameterError, match="k is fixed"):
        replace(load(text, "M"), {"k": 0.5})


OPEN = """model Open
  parameter Boolean used = true;
  parameter Integer seed(fixed = false);
  parameter Integer own = if used then seed else 7;
  parameter Boolean big = own > 3;
  Real y = own * time + (if big then 100 else 0);
initial equation
  seed = 5;
end Open;
"""


@pytest.mark.parametrize(("model", "y"), [("Open", 105.0), ("Open(used = false)", 107.0)])
def test_whole_parameters_may_follow_one_that_initial_equations_determine(model: str, y: float) -> None:
    assert simulate(load(OPEN, model), 1.0, save="end")["y"][-1] == pytest.approx(y)
