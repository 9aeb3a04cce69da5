"""New values of elements of arrays at events."""

import numpy as np
from numpy.testing import assert_allclose

from acausal import simulate
from acausal.modelica import load

RESETS = """
model Resets
  parameter Integer k = 2;
  Real x[3](each start = 0, each fixed = true), y[2, 2](each start = 1, each fixed = true);
equation
  der(x) = {1, 2, 3};
  der(y) = zeros(2, 2);
  when time > 0.3 then
    reinit(x[k], 10 * x[1]);
    reinit(x[1], 5);
    for i in 1:2 loop
      reinit(y[i, i], i);
    end for;
  end when;
  when time > 0.3 then
    reinit(x[3], -pre(x[3]));
  elsewhen time > 0.6 then
    reinit(x[1:2], {100, 200});
    reinit(y[2, :], {8, 9});
    if x[1] > 50 then
      reinit(x[3], 0);
    else
      reinit(x[3], 1000);
    end if;
  end when;
  when x[1] > 4.5 then
    reinit(x[3], x[3] - 50);
  end when;
end Resets;
"""


def test_elements_of_an_array_get_new_values_together_and_one_after_the_other() -> None:
    sol = simulate(load(RESETS, "Resets"), 1.0, save=np.array([0.2, 0.5, 0.8]))
    # At 0.3 s, x[1] becomes 5, at which the last clause acts on the x[3] that the second one has set.
    assert_allclose(sol["x"], [[0.2, 0.4, 0.6], [5.2, 3.4, -50.3], [100.2, 200.4, 1000.6]])
    assert_allclose(sol["y"][1:], [[[1, 1], [1, 2]], [[1, 1], [8, 9]]])
