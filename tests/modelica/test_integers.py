"""Events of `floor`, `ceil`, `integer`, `div`, `mod` and `rem`, against closed forms."""

from typing import Any

import jax
import numpy as np
import pytest

from acausal import replace, simulate
from acausal.modelica import load

SAWTOOTH = """
model Sawtooth
  parameter Real period = 0.3;
  Real x(start = 0, fixed = true);
equation
  der(x) = mod(time, period);
end Sawtooth;
"""

STEPPED = """
model Stepped
  parameter Real period = 0.5;
  parameter Real start = 1.5;
  Real x(start = 0, fixed = true);
equation
  der(x) = mod(time, period) + (if time < start then 3 else 0);
end Stepped;
"""

FUNCTIONS = """
package P
  function inside "Functions cause no events"
    input Real x;
    output Real y;
  algorithm
    y := floor(x);
  end inside;
  model Functions
    parameter Real factors[2] = {1, 3};
    Real s(start = 0, fixed = true) "t - t^2, first up, then down";
    Real whole, quotient, remainder, above, several[2], plain, called, assigned, least, hidden;
    Integer number, count(start = 0, fixed = true);
  equation
    der(s) = 1 - 2 * time;
    whole = floor(2 * time);
    number = integer(2 * time + 0.25);
    quotient = div(4 * s - 0.5, 1);
    remainder = rem(4 * s - 0.5, 1);
    above = ceil(4 * s);
    several = floor(factors * time);
    plain = noEvent(floor(2 * time));
    called = inside(2 * time);
    least = sum(floor(i * time) for i in 1:2);
    hidden = smooth(1, mod(time, 1) ^ 2);
    when mod(time, 0.5) > 0.25 then
      count = pre(count) + 1;
    end when;
  algorithm
    assigned := 2 * time;
    if assigned > 1 then
      assigned := floor(assigned) + 10;
    end if;
  end Functions;
end P;
"""


def test_a_run_stops_at_the_jumps_of_a_sawtooth() -> None:
    """The integral is 6 p^2 / 2 + (2 - 6 p)^2 / 2; its integrand is linear between the jumps."""
    sawtooth: Any = load(SAWTOOTH, "Sawtooth")

    def end(period: Any) -> Any:
        return simulate(replace(sawtooth, {"period": period}), 2.0, save="end").x[-1]

    value, slope = jax.jvp(end, (0.3,), (1.0,))
    assert float(value) == pytest.approx(0.29, abs=1e-12)
    assert float(slope) == pytest.approx(0.6, abs=1e-10)


@pytest.mark.thorough
@pytest.mark.parametrize("mode", [jax.jacfwd, jax.jacrev])
def test_a_jump_that_coincides_with_a_step(mode: Any) -> None:
    """The integral until 1.9 is 3 p^2 / 2 + (1.9 - 3 p)^2 / 2 + 3 start."""
    stepped: Any = load(STEPPED, "Stepped")

    def end(numbers: Any) -> Any:
        return simulate(replace(stepped, {"period": numbers[0], "start": numbers[1]}), 1.9, save="end").x[-1]

    assert mode(end)(np.array([0.5, 1.5])) == pytest.approx(np.array([0.3, 3.0]), abs=1e-10)


def test_values_jump_at_their_instants() -> None:
    around = np.array([0.25, 0.375, 0.5, 0.75, 0.875, 1.0, 4 / 3, 1.5, 1.75, 1.875])
    t = np.sort(np.concatenate([around - 1e-9, around + 1e-9, np.linspace(0.013, 1.97, 50)]))
    sol: Any = simulate(load(FUNCTIONS, "P.Functions"), 2.0, save=t)
    s = t - t**2
    assert np.allclose(sol.s, s, atol=1e-12)
    assert np.allclose(sol.whole, np.floor(2 * t))
    assert np.allclose(sol.number, np.floor(2 * t + 0.25))
    assert np.allclose(sol.quotient, np.trunc(4 * s - 0.5))
    assert np.allclose(sol.remainder, np.fmod(4 * s - 0.5, 1), atol=1e-11)
    assert np.allclose(sol.above, np.ceil(4 * s))
    assert np.allclose(sol.several, np.floor(np.outer(t, [1, 3])))
    assert np.allclose(sol.plain, np.floor(2 * t))
    assert np.allclose(sol.called, np.floor(2 * t))
    assert np.allclose(sol.least, np.floor(t) + np.floor(2 * t))
    assert np.allclose(sol.hidden, (t % 1) ** 2)
    assert np.allclose(sol["count"], np.floor(2 * t + 0.5))
    assert np.allclose(sol.assigned, np.where(t < 0.5, 2 * t, np.floor(2 * t) + 10))
