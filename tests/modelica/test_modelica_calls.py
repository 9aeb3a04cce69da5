"""Calls in equations: those without results, and those that cannot be evaluated, which are refused with their place."""

import pytest
from numpy.testing import assert_allclose

from acausal import ModelError, simulate
from acausal.modelica import ModelicaError, load

FUNCTIONS = """
record R Real a; Real b; end R;
function scalar input Real x; output Real y; algorithm y := x; end scalar;
function vector input Real x; output Real y[2]; algorithm y := {x, x}; end vector;
function fields input Real x; output R y; algorithm y := R(x, x); end fields;
function several input Real x; output Real y; output Real z[2]; algorithm y := x; z := {x, x}; end several;
function none input Real x; algorithm assert(x > 0, "negative"); end none;
function factorial input Integer n; output Integer y; algorithm y := if n < 2 then 1 else n * factorial(n - 1);
end factorial;
function total input Integer n; output Integer y = 0; algorithm for i in 1:n loop y := y + i; end for; end total;
function sized input Integer n; output Real y; protected Real a[n] = ones(n); algorithm y := sum(a); end sized;
function third input Real v[:]; output Real y; protected Integer k = 3; algorithm y := v[k]; end third;
function empty input Real x; output Real y; end empty;
function joint input Real v[:]; input Real w[size(v, 1)]; output Real y; algorithm y := v * w; end joint;
"""


def text(line: str) -> str:
    return f"""package P {FUNCTIONS}
model M
  Real x(start = 0, fixed = true);
  Integer k = if x > 2 then 3 else 2;
{line}
  der(x) = 1;
end M;
end P;
"""


PLACES = ["{};", "if x > 0.5 then {}; end if;", "when x > 0.5 then {}; end when;", "for i in 1:2 loop {}; end for;"]


@pytest.mark.parametrize("place", PLACES)
def test_a_call_without_a_left_side_is_no_equation(place: str) -> None:
    calls = [f"{name}(x + 1)" for name in ("scalar", "vector", "fields", "several", "none")]
    model = load(text("equation\n" + "\n".join(place.format(call) for call in calls)), "P.M")
    assert_allclose(simulate(model, 1.0, save="end")["x"][-1], 1.0)


def test_a_call_without_a_left_side_checks_what_is_known() -> None:
    with pytest.raises(ModelError, match="negative"):
        simulate(load(text("equation\n  none(-1);"), "P.M"), 1.0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ("factorial(k)", "a function calls itself, and the number of calls is not known"),
        ("total(k)", "the range of a loop is not known before a run"),
        ("sized(k)", "a size, or the range of a loop, is not known before a run"),
        ("third({x, x})", "the subscript 3 of an array of 2 is out of bounds"),
        ("joint({1, 2, 3}, {x, 2})", "shape"),
        ("empty(x)", "the function P.empty has no algorithm that gives its outputs values"),
        ("sum([1, x; 2, 3]^k)", "the exponent of a matrix must be known when the model is loaded"),
    ],
)
def test_a_call_that_cannot_be_evaluated_is_refused_with_its_place(call: str, message: str) -> None:
    line = 1 + text("@").splitlines().index("@")
    with pytest.raises(ModelicaError, match=rf"<model>\.mo:{line}: .*{message}"):
        simulate(load(text(f"  Real y = {call};\nequation"), "P.M"), 1.0)


@pytest.mark.parametrize("equation", ["n = 3", "1 = 2", "{n, 1} = {2, 2}", "n > 2 = true", "scalar(3) = n"])
@pytest.mark.parametrize("section", ["equation", "initial equation"])
def test_an_equation_of_known_values_must_hold(section: str, equation: str) -> None:
    left, right = equation.split(" = ")
    lines = f"  parameter Integer n = 2;\n{section}\n  {left} = VALUE;\nequation"
    load(text(lines.replace("VALUE", left)), "P.M")
    with pytest.raises(ModelicaError, match=r"<model>\.mo:\d+: the sides of this equation are known, and differ"):
        load(text(lines.replace("VALUE", right)), "P.M")


@pytest.mark.parametrize("equation", ["0.1 * 3e12 = 3e11", "0.1 * 3e12 - 3e11 = 0", "{0.1 * 3e12, 1} = {3e11, 1}"])
def test_known_sides_of_an_equation_may_differ_by_rounding(equation: str) -> None:
    load(text(f"equation\n  {equation};\nequation"), "P.M")
    with pytest.raises(ModelicaError, match="the sides of this equation are known, and differ"):
        load(text(f"equation\n  {equation.replace('3e11', '3.00001e11')};\nequation"), "P.M")


def test_a_parameter_that_cannot_be_evaluated_is_refused_with_its_place() -> None:
    line = 1 + text("@").splitlines().index("@")
    for declared in (
        "parameter Real a = third({1, 2});",
        "parameter Real a = b; parameter Real b = a;",
        "parameter Real a = mod(1.0, 0);",
    ):
        with pytest.raises(ModelicaError, match=rf"<model>\.mo:{line}: "):
            load(text(f"  {declared}\nequation"), "P.M")


@pytest.mark.parametrize("clock", ["Clock(0)", "Clock(-0.1)", "Clock(-1, 10)", "Clock(1, 0)"])
def test_the_interval_of_a_clock_is_positive(clock: str) -> None:
    clause = f"when {clock} then n = previous(n) + 1; end when;"
    with pytest.raises(ModelicaError, match="the interval of a clock must be positive"):
        load(f"model M Integer n(start = 0), k = hold(n); equation {clause} end M;", "M")
