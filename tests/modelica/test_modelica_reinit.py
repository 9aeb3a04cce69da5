"""New values of states at events."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose

from acausal import replace, simulate
from acausal.modelica import load

RESETS = """
model Resets
  parameter Integer k = 2;
  Real x[3](each start = 0, each fixed = true), y[2, 2](each start = 1, each fixed = true);
  Real z(start = 0, fixed = true);
equation
  der(x) = {1, 2, 3};
  der(y) = zeros(2, 2);
  der(z) = 0;
  when time > 0.3 then
    reinit(x[k], 10 * x[1]);
    reinit(x[1], 5);
    for i in 1:2 loop
      reinit(y[i, i], i);
    end for;
  elsewhen time > 0.6 then
    reinit(x[1:2], {100, 200});
    reinit(y[2, :], {8, 9});
  end when;
  when time > 0.3 then
    reinit(x[3], -pre(x[3]));
  elsewhen time > 0.6 then
    if x[1] > 50 then
      reinit(x[3], 0);
    else
      reinit(x[3], 1000);
    end if;
  end when;
  when x[1] > 4.5 then
    reinit(z, x[3] - 50);
  end when;
end Resets;
"""


def test_elements_of_an_array_get_new_values_together_and_one_after_the_other() -> None:
    sol = simulate(load(RESETS, "Resets"), 1.0, save=np.array([0.2, 0.5, 0.8]))
    # At 0.3 s, x[1] becomes 5, at which the last clause reads the x[3] that the second one has set.
    assert_allclose(sol["x"], [[0.2, 0.4, 0.6], [5.2, 3.4, -0.3], [100.2, 200.4, 1000.6]])
    assert_allclose(sol["z"], [0, -50.9, -50.9], atol=1e-12)
    assert_allclose(sol["y"][1:], [[[1, 1], [1, 2]], [[1, 1], [8, 9]]])


# A pulse in each period: its width is sampled, a condition on time starts it, and z is reset
PULSES = """
model Pulses
  parameter Real T = 1;
  Real x(start = 0, fixed = true), z(start = 0, fixed = true);
  discrete Real begin(start = 0, fixed = true), width(start = 0, fixed = true);
  Integer count(start = 0, fixed = true);
equation
  der(x) = if width > time - begin then 1 else 0;
  der(z) = 1;
  when sample(T, T) then
    width = 0.1 * time;
  end when;
  when time >= (pre(count) + 1) * T then
    count = pre(count) + 1;
    begin = time;
  end when;
  when sample(T, T) then
    reinit(z, 0);
  end when;
end Pulses;
"""


@pytest.mark.parametrize("mode", [jax.jacfwd, jax.jacrev])
def test_derivatives_if_a_reset_and_a_relation_follow_from_events_of_one_instant(mode: Any) -> None:
    """The pulse from k T ends at 1.1 k T. Until 4.5 T there are four, with x = (0.1 + 0.2 + 0.3 + 0.4) T."""

    def run(T: Any) -> Any:
        solution = simulate(replace(load(PULSES, "Pulses"), {"T": T}), 4.5, save="end")
        return jnp.stack([solution[name][-1] for name in ("x", "z", "begin", "width")])

    assert_allclose(run(1.0), [1.0, 0.5, 4.0, 0.4], rtol=1e-9)
    assert_allclose(mode(run)(1.0), [1.0, -4.0, 4.0, 0.4], rtol=1e-9)
