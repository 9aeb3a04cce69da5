"""Derivatives of a Modelica model at the time of a sample that moves with the differentiated parameter."""

import jax
import pytest

from acausal import JumpWarning, replace, simulate
from acausal.modelica import load

MEAN = """
model Mean "as Modelica.Blocks.Math.Mean"
  parameter Real f = 10;
  Real x(start = 0, fixed = true), y(start = 0, fixed = true);
equation
  der(x) = time;
  when sample(1 / f, 1 / f) then
    y = f * pre(x);
    reinit(x, 0);
  end when;
end Mean;
"""


@pytest.mark.thorough
def test_a_mean_at_the_end_of_its_period() -> None:
    """At the end of the fifth period, x = (2 t - 1/f) / (2 f) is about to be reset. Its derivative is that before."""
    model = load(MEAN, "Mean")

    def end(f: float, t1: float) -> jax.Array:
        return simulate(replace(model, {"f": f}), t1, save="end", rtol=1e-9).final.x

    with pytest.warns(JumpWarning, match=r"at the time of a sample every 0\.1 s, which depends"):
        slope = jax.jacfwd(end)(10.0, 0.5)
    assert slope == pytest.approx(0.4 * 4 / 10.0**2, rel=1e-6)  # x = (t^2 - (4/f)^2) / 2
    assert jax.jacfwd(end)(10.0, 0.45) == pytest.approx(0.4 * 4 / 10.0**2, rel=1e-6)
