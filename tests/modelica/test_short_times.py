"""Periodic pulses of nanoseconds, whose relations compare the time with a discrete variable."""

import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose

from acausal import UnresolvedWarning, replace, simulate
from acausal.modelica import load

TEXT = """
model Pulses "as Modelica.Blocks.Sources.Trapezoid"
  parameter Real s(unit = "s") = 1;
  Real begin(unit = "s", start = s, fixed = true), y, x(start = 0, fixed = true);
equation
  when sample(s, 4*s) then
    begin = time;
  end when;
  y = if time < s or time >= begin + 3*s then 0
    else if time < begin + s then (time - begin)/s
    else if time < begin + 2*s then 1
    else (begin + 3*s - time)/s;
  s*der(x) = y - x;
end Pulses;
"""


@pytest.mark.parametrize("scale", [1e-9, 1e3])
def test_pulses_do_not_depend_on_the_unit_of_time(scale: float) -> None:
    model = replace(load(TEXT, "Pulses"), {"s": scale})
    times = np.array([0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5, 8.5])
    with warnings.catch_warnings():
        warnings.simplefilter("error", UnresolvedWarning)
        solution = simulate(model, 9 * scale, save=times * scale, rtol=1e-6)
    assert_allclose(solution["y"], [0, 0.5, 1, 0.5, 0, 0.5, 1, 0.5, 0], atol=1e-9)
    rise = 0.5 - 1 + np.exp(-0.5)  # x = t - 1 + exp(-t) while y = t
    assert solution["x"][1] == pytest.approx(rise, rel=1e-4)
