"""Start values of Modelica models that depend on relations at the start."""

from typing import Any

import jax
import numpy as np
import pytest

from acausal import check, initialise, replace, simulate
from acausal.modelica import ModelicaError, ModelicaModel, load

OFFSET = """
model Offset "A fixed start value of y, which a law of time ties to the state x"
  parameter Real y0 = 1;
  Real x(stateSelect = StateSelect.prefer), y(stateSelect = StateSelect.avoid, start = y0, fixed = true), s, dy;
equation
  x = y + s;
  s = if time < 1 then 0.5 * time else 5 + 0.5 * (time - 1);
  dy = der(y);
  der(x) = 0.5 - y;
end Offset;
"""
TIED = """
model Tied "Two rigidly tied masses, with a rate as a state, beside a law of time whose derivative is their start speed"
  Real x(stateSelect = StateSelect.prefer), y(stateSelect = StateSelect.avoid);
  Real v(stateSelect = StateSelect.avoid), w(stateSelect = StateSelect.avoid), f, s, speed;
initial equation
  x = 2 + s;
  v = speed;
equation
  y = 3 * x;
  v = der(x);
  w = der(y);
  der(v) = f;
  der(w) = -x - 3 * f;
  s = if time < 0 then 7 else if time < 1 then time ^ 2 / 2 else time - 0.5;
  speed = der(s);
end Tied;
"""
HELD = """
package Springs
  model Spring
    parameter Real c;
    Real x, f;
  equation
    f = -c * x;
  end Spring;
  model Part
    parameter Real c(start = 1);
    Spring spring(c = c);
  end Part;
  model Held "A mass at rest: the start determines the stiffness of its spring"
    parameter Real m = 2;
    Part part(c(start = 100, fixed = false));
    Real x(start = 0.5, fixed = true), v(start = 0, fixed = true), a(start = 0, fixed = true);
  equation
    part.spring.x = x;
    v = der(x);
    a = der(v);
    m * a = 9.81 * m + part.spring.f;
  end Held;
end Springs;
"""
STUCK = """
model Stuck "A mass at rest, but for rounding, that a force pulls out of its friction at t = 1"
  parameter Real p = 0.1, q = 0.2, r = 0.3;
  Real w, a, sa, force;
  Boolean forward, backward, locked;
  Integer mode(start = 3, fixed = true);
initial equation
  w = p + q - r;
equation
  der(w) = a;
  a = time - force;
  forward = pre(mode) == 0 and (sa > 1 or pre(forward) and sa > 1) or initial() and w > 0;
  backward = pre(mode) == 0 and (sa < -1 or pre(backward) and sa < -1) or initial() and w < 0;
  locked = not (pre(mode) == 1 or forward or pre(mode) == -1 or backward);
  a = if locked then 0 else if forward or not backward and pre(mode) == 1 then sa - 1 else sa + 1;
  force = if locked then sa else if forward or not backward and pre(mode) == 1 then 1 else -1;
  mode = if (pre(mode) == 1 or forward) and w > 0 then 1
    elseif (pre(mode) == -1 or backward) and w < 0 then -1 else 0;
end Stuck;
"""


@pytest.mark.thorough
def test_a_dependent_start_value_holds_in_the_branch_of_the_start() -> None:
    """With x = y + t / 2, der(y) = -y."""
    model = load(OFFSET, "Offset")

    def end(y0: Any) -> Any:
        return simulate(replace(model, {"y0": y0}), 0.5, save="end", rtol=1e-9)["y"][-1]

    value, slope = jax.value_and_grad(end)(2.0)
    assert value == pytest.approx(2.0 * np.exp(-0.5), rel=1e-7)
    assert slope == pytest.approx(np.exp(-0.5), rel=1e-7)


@pytest.mark.thorough
def test_check_starts_in_the_branch_of_the_start() -> None:
    assert not check(load(OFFSET, "Offset")).problems


@pytest.mark.thorough
def test_states_that_are_rates_start_in_the_branch_of_the_start() -> None:
    """With y = 3 x, 6 der(x, 2) = -x; s and its rate are zero at the start."""
    solution = simulate(load(TIED, "Tied"), 0.5, save="end", rtol=1e-9)
    assert solution["x"][-1] == pytest.approx(2.0 * np.cos(0.5 / np.sqrt(6.0)), rel=1e-7)


@pytest.mark.thorough
def test_rounding_errors_at_the_start_have_no_direction() -> None:
    """0.1 + 0.2 - 0.3 is not zero, but friction holds until the force exceeds 1. Then der(w) = t - 1."""
    solution = simulate(load(STUCK, "Stuck"), 2.0, rtol=1e-9)
    assert 0.0 < solution["w"][0] < 1e-16
    assert solution["mode"][0] == 0.0
    assert solution["w"][-1] == pytest.approx(0.5, rel=1e-7)


@pytest.mark.thorough
def test_a_parameter_that_the_start_determines_determines_others() -> None:
    """c = m g / x."""
    solution = simulate(load(HELD, "Springs.Held"), 1.0)
    assert solution["part.spring.c"][-1] == pytest.approx(2.0 * 9.81 / 0.5)
    assert solution["x"][-1] == pytest.approx(0.5)


FOUND = """
model Found
  parameter Real p(fixed = false), q(fixed = false), twice = 2 * p;
  Real x[2](start = {twice, 2}, each fixed = true), y;
initial equation
  p = 3.5;
  y = q;
initial algorithm
  q := 5;
  q := q + 2;
equation
  der(x) = -x;
  der(y) = -y;
end Found;
"""


def test_starts_follow_parameters_that_the_initialisation_determines() -> None:
    sol = simulate(load(FOUND, "Found"), 1.0, save=[0.0, 1.0], rtol=1e-9)
    for name, start in (("x", [7.0, 2.0]), ("y", 7.0)):
        assert sol[name] == pytest.approx(np.multiply.outer([1.0, np.exp(-1.0)], start), rel=1e-8)
    discrete = (
        "model M parameter Real m(fixed = false); discrete Real n(start = m, fixed = true); initial equation m = 4; "
    )
    with pytest.raises(ModelicaError, match=r"<model>.mo:1: .* n reads a parameter .*state pre\(n\)"):
        load(discrete + "equation when time > 0.5 then n = pre(n) + 1; end when; end M;", "M")


NEAR = """
package P
  model Equal
    Real u(start = 5), v(start = -5), w(start = 5), z(start = -5);
  equation
    u = v;
    u * u = 9;
    w = -z;
    w * w = 9;
  end Equal;
  model Near
    Equal a(u(start = 1), z(start = 1)), b(v(start = -1), w(start = 1)), c(v(start = 1));
    Equal d(u(start = -1));
  end Near;
end P;
"""


def test_the_start_value_of_the_modifier_closest_to_the_top_counts_for_equal_variables() -> None:
    sol = simulate(load(NEAR, "P.Near"), 0.1, save="end")
    assert [float(sol[f"{part}.u"][-1]) for part in "abcd"] == pytest.approx([3.0, -3.0, 3.0, -3.0])
    assert [float(sol[f"{part}.w"][-1]) for part in "ab"] == pytest.approx([-3.0, 3.0])


def ticking(initial: str) -> ModelicaModel:
    """Samples of 1 + x with x = 2 exp(-t), by a Boolean variable and directly."""
    text = f"""
model M
  parameter Real p = 10;
  Real x;
  Boolean due;
  discrete Real h(start = 0, fixed = true), k(start = 0, fixed = true);
initial equation
  {initial};
equation
  der(x) = -x;
  due = sample(0, 1);
  when due then
    h = 1 + x;
  end when;
  when sample(0, 1) then
    k = 1 + x;
  end when;
end M;"""
    return load(text, "M")


@pytest.mark.parametrize("initial", ["x = 2", "x + x ^ 3 = p", "der(x) = -2"])
def test_clocks_tick_after_the_initial_equations(initial: str) -> None:
    fresh = ticking(initial)
    for model in (fresh, initialise(fresh)):
        solution = simulate(model, 1.5, save=[0.5, 1.5], rtol=1e-9)
        for name in ("h", "k"):
            assert solution[name] == pytest.approx(1.0 + 2.0 * np.exp([0.0, -1.0]), rel=1e-7)


@pytest.mark.thorough
def test_the_derivatives_of_what_a_clock_reads_at_the_start_include_those_of_the_initial_equations() -> None:
    """x + x^3 = p gives dx/dp = 1 / (1 + 3 x^2), and x = 2 for p = 10."""
    model = ticking("x + x ^ 3 = p")

    def read(p: Any) -> Any:
        sampled = simulate(replace(model, {"p": p}), 1.5, save=[0.5, 1.5], rtol=1e-9, max_steps=256)
        return sampled["h"]

    exact = np.exp([0.0, -1.0]) / 13.0
    np.testing.assert_allclose(jax.jacfwd(read)(10.0), exact, rtol=1e-6)
    np.testing.assert_allclose(jax.jacrev(read)(10.0), exact, rtol=1e-6)
