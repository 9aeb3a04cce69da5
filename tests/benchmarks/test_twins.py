"""The comparison of circuits made twice."""

import dataclasses

import pytest

from benchmarks.twins.__main__ import deviations, differs
from benchmarks.twins.heat_and_signals import twins

LOOP = """
model Loop
  parameter Real gain = 2;
  record Signal Real y; end Signal;
  Signal plant, controller;
  Real x(start = 0, fixed = true), v(start = 0, fixed = true), e;
equation
  e = (if time < 0.2 then 0 else 1) - v;
  0.3 * der(x) = e;
  0.5 * der(v) = 1.5 * controller.y - v;
  controller.y = gain * (e + x);
  plant.y = v;
end Loop;
"""


@pytest.mark.thorough
def test_a_twin_with_another_gain_differs() -> None:
    """The loop of the twins without the Standard Library."""
    loop = dataclasses.replace(next(twin for twin in twins() if twin.name == "Loop"), text=LOOP)
    other = dataclasses.replace(loop, text=LOOP.replace("gain = 2", "gain = 2.1"))
    assert [differs(deviations(twin, [])) for twin in (loop, other)] == [False, True]


@pytest.mark.parametrize(("deviation", "expected"), [(1e-7, False), (2e-6, True), (float("nan"), True)])
def test_deviations_and_nan_count_as_differences(deviation: float, expected: bool) -> None:
    assert differs({"x": 0.0, "y": deviation}) is expected
