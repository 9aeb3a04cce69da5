"""`delay` by a parameter: the method of steps, and waves on a line."""

from math import factorial

import jax
import numpy as np
import pytest

from acausal import SimulationError, replace, simulate
from acausal.modelica import load

LOOP = """
model Loop
  parameter Real T = 1;
  Real x(start = 1, fixed = true);
equation
  der(x) = -delay(x, T);
end Loop;
"""

LINE = """
model Line "a line that is open at its end, and a step at its beginning"
  parameter Real Z = 50;
  parameter Real T = 1;
  Real v1, i1, v2, i2;
equation
  v1 - Z * i1 = delay(v2 + Z * i2, T);
  v2 - Z * i2 = delay(v1 + Z * i1, T);
  v1 = if time > 0.5 then 1 else 0;
  i2 = 0;
end Line;
"""


@pytest.mark.thorough
def test_a_loop_with_a_delay_and_its_derivative_by_the_delay() -> None:
    """With x = 1 up to the start, x is a polynomial in each interval of length T."""
    model = load(LOOP, "Loop")

    def end(T: float) -> jax.Array:
        return simulate(replace(model, {"T": T}), 3.3, rtol=1e-9, save="end").final.x

    def exact(T: float) -> float:
        return sum((-1.0) ** i * (3.3 - (i - 1) * T) ** i / factorial(i) * ((i - 1) * T < 3.3) for i in range(9))

    value, slope = jax.value_and_grad(end)(0.7)
    assert value == pytest.approx(exact(0.7), abs=1e-9)
    assert slope == pytest.approx((exact(0.7 + 1e-5) - exact(0.7 - 1e-5)) / 2e-5, abs=1e-8)


@pytest.mark.thorough
def test_a_wave_is_reflected_at_both_ends_of_a_line() -> None:
    """At the open end the voltage doubles when the wave arrives, and falls when it returns: v2(t) = 2 v1(t - T) -
    v2(t - 2 T).
    """
    times = 0.5 + np.array([0.9, 1.1, 2.9, 3.1, 4.9, 5.1, 6.9])
    solution = simulate(load(LINE, "Line"), 8.0, save=times)
    assert solution["v2"] == pytest.approx([0.0, 2.0, 2.0, 0.0, 0.0, 2.0, 2.0], abs=1e-12)
    assert solution["i1"] == pytest.approx(np.array([1.0, 1.0, -1.0, -1.0, 1.0, 1.0, -1.0]) / 50.0, abs=1e-12)


def test_an_assertion_reads_a_delay() -> None:
    text = 'model M Real x = time; equation assert(delay(x, 0.5) < 0.3, "late"); end M;'
    with pytest.raises(SimulationError, match=r"At t = 0\.8 s: assert .*: late"):
        simulate(load(text, "M"), 1.0)
