"""Start values that a Modelica model states by `fixed=true` or by initial equations hold, or the model is refused."""

from typing import Any, Self

import numpy as np
import pytest

from acausal import Component, Equations, Param, Scalar, SimulationError, Var, eq, initialise, replace, simulate
from acausal.modelica import load

TANK = """
model Tank "Torricelli's law"
  Real h(start = 1{h}), v(start = 1{v}, min = 0);
  parameter Real g = 9.81, q = 0.1;
equation
  der(h) = -q * v;
  v ^ 2 = 2 * g * h;
{initial}
end Tank;
"""
HEAT = """
model Heat "an internal energy that grows with the square of the temperature"
  Real E(start = 1), T(start = 3, fixed = true);
  parameter Real k = 2;
equation
  der(E) = -0.1 * T;
  T ^ 2 = 2 * E / k;
end Heat;
"""
LIQUID = """
model Liquid "a tank with a start value of its level, in which equations differentiate the mass"
  type Density = Real(start = 1);
  parameter Real A = 2, rho = 995, level_start = 0.8;
  Real level(start = level_start), V, m;
  Density d;
  Real T(start = 300, fixed = true);
equation
  der(m) = 0;
  der(T) = 0;
  m = V * d;
  V = A * level;
  d = {density};
end Liquid;
"""


def tank(**parts: str) -> Any:
    return load(TANK.format(**{"h": "", "v": "", "initial": "", **parts}), "Tank")


def start(model: Any) -> Any:
    return simulate(model, 0.0, save="end").final


@pytest.mark.parametrize("parts", [{"v": ", fixed = true"}, {"initial": "initial equation\n  v = 1;"}])
def test_a_start_value_of_an_unknown_of_a_nonlinear_equation_holds(parts: dict[str, str]) -> None:
    final = start(tank(**parts))
    assert final.v == pytest.approx(1.0, rel=1e-9)
    assert final.h == pytest.approx(1.0 / (2.0 * 9.81), rel=1e-9)


@pytest.mark.thorough
def test_the_state_of_a_square_law_follows_its_temperature() -> None:
    model = load(HEAT, "Heat")
    assert float(start(model).E) == pytest.approx(9.0, rel=1e-9)
    assert float(start(replace(model, {"T": 2.0, "k": 3.0})).E) == pytest.approx(6.0, rel=1e-9)


def test_contradictory_start_values_are_refused() -> None:
    with pytest.raises(SimulationError, match=r"start values contradict the equations\. v cannot have"):
        start(tank(h=", fixed = true", v=", fixed = true"))


@pytest.mark.parametrize("density", ["rho", "rho + 300 - T"])
def test_a_start_value_reaches_the_state_through_a_variable_with_the_start_value_of_its_type(density: str) -> None:
    final = start(load(LIQUID.format(density=density), "Liquid"))
    assert (final.level, final.m) == pytest.approx((0.8, 2.0 * 995.0 * 0.8), rel=1e-12)


class Tank(Component):
    """The same law in Python."""

    g: Param[Scalar, ""] = 9.81
    h: Var[Scalar, ""] = 1.0
    v: Var[Scalar, ""] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(level=eq(d.h, -0.1 * self.v), law=eq(self.v**2, 2.0 * self.g * self.h))


def test_a_given_value_determines_a_state_without_one_and_is_a_guess_otherwise() -> None:
    assert start(Tank(v=2.0)).h == pytest.approx(4.0 / (2.0 * 9.81), rel=1e-9)
    assert start(Tank(h=2.0, v=-1.0)).v == pytest.approx(-np.sqrt(4.0 * 9.81), rel=1e-9)
    at_rest = initialise(Tank(v=-2.0))
    assert start(replace(at_rest, {"g": 1.0})).v == pytest.approx(-np.sqrt(2.0 * float(at_rest.h)), rel=1e-9)


OPEN = """
model Open
  parameter Real p(fixed = false{guess});
  Real x(start = 0, fixed = true);
initial equation
  p ^ 2 = 9;
equation
  der(x) = p;
end Open;
"""


@pytest.mark.parametrize("guess", [1.0, -1.0])
def test_the_start_of_an_open_parameter_is_the_guess(guess: float) -> None:
    final = start(load(OPEN.format(guess=f", start = {guess}"), "Open"))
    assert final.p == pytest.approx(3.0 * guess, rel=1e-9)


def test_a_guess_at_which_a_condition_has_no_slope_is_named() -> None:
    with pytest.raises(SimulationError, match=r"if a condition depends on them, give other initial guesses of p\."):
        start(load(OPEN.format(guess=""), "Open"))


RATES = """
model Rates "a second derivative of y, with the start of x"
  Real x(start = 0.3{fixed}), y, a, b;
equation
  y = {law};
  der(der(y)) = -y;
  a = der(y * der(y));
  b = der(a);
initial equation
  {more}der(x) = 0.7;
end Rates;
"""


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("law", "y", "rate"), [("2 * x + 1", 1.6, 1.4), ("x ^ 3", 0.027, 3.0 * 0.09 * 0.7)], ids=["linear", "cubic"]
)
@pytest.mark.parametrize("parts", [{"fixed": ", fixed = true", "more": ""}, {"fixed": "", "more": "x = 0.3; "}])
def test_derivatives_of_derivatives(parts: dict[str, str], law: str, y: float, rate: float) -> None:
    """y oscillates with the angular frequency 1. The product p = y y' has p' = y'^2 - y^2 and p'' = -4 p."""
    model = load(RATES.format(law=law, **parts), "Rates")
    t = np.linspace(0.0, 0.2, 3)
    sol = simulate(model, 0.2, save=t, rtol=1e-10)
    expected, slope = y * np.cos(t) + rate * np.sin(t), rate * np.cos(t) - y * np.sin(t)
    assert sol["y"] == pytest.approx(expected, rel=1e-8)
    assert sol["a"] == pytest.approx(slope**2 - expected**2, rel=1e-7)
    assert sol["b"] == pytest.approx(-4.0 * expected * slope, rel=1e-7)


ELEMENTS = """
model Elements "Arrays in which some elements have fixed start values"
  parameter Real p = 4, q(fixed = false);
  Real x[3](each start = p, fixed = {true, false, true});
  Real y[2, 2](start = [1, 2; 3, p], fixed = [false, true; false, true]);
  Real z[2](each start = q, fixed = {true, false});
initial equation
  x[1] + x[2] = 7;
  sum(y) = 10;
  y[1, 1] = y[2, 1];
  q = 3;
  z[1] + z[2] = 5;
equation
  der(x) = zeros(3);
  der(y) = zeros(2, 2);
  der(z) = zeros(2);
end Elements;
"""


@pytest.mark.thorough
@pytest.mark.parametrize("p", [4.0, 6.0])
def test_fixed_elements_of_arrays_keep_their_start_values(p: float) -> None:
    """The initial equations determine the other elements."""
    start = simulate(replace(load(ELEMENTS, "Elements"), {"p": p}), 0.1)
    assert start["x"][0].tolist() == pytest.approx([p, 7.0 - p, p])
    free = (10.0 - 2.0 - p) / 2.0
    assert start["y"][0].tolist() == [pytest.approx([free, 2.0]), pytest.approx([free, p])]
    assert start["z"][0].tolist() == pytest.approx([3.0, 2.0])
