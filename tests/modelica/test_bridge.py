"""Ideal diodes as parametric curves, in a bridge of three phases."""

import numpy as np

from acausal import simulate
from acausal.modelica import load

TEXT = """
package P
  model Diode "The current over the voltage, as a curve with the parameter s"
    parameter Real R(min = 0) = 1e-5, G(min = 0) = 1e-5;
    Real v, i, s(start = 0);
    Boolean off(start = true);
  equation
    off = s < 0;
    v = s * (if off then 1 else R);
    i = s * (if off then G else 1);
  end Diode;
  model Bridge
    Diode up[3], down[3];
    Real source[3], plus, minus, u, i;
  equation
    for k in 1:3 loop
      source[k] = 100 * sin(314 * time - 2.0943951023931953 * k);
      up[k].v = source[k] - plus;
      down[k].v = minus - source[k];
    end for;
    up[1].i + up[2].i + up[3].i = i;
    down[1].i + down[2].i + down[3].i = i;
    u = plus - minus;
    u = 20 * i;
  end Bridge;
end P;
"""


def test_six_diodes_commutate() -> None:
    times = np.linspace(0.0003, 0.0203, 41)
    solution = simulate(load(TEXT, "P.Bridge"), 0.021, save=times)
    source = np.asarray(solution["source"])
    assert np.allclose(solution["u"], source.max(axis=1) - source.min(axis=1), rtol=1e-4)
    # The currents are exact, although a voltage divided by both the resistance and the conductance would be large.
    currents = sum(np.asarray(solution[f"down[{k}].i"]) for k in (1, 2, 3))
    assert np.allclose(currents, solution["i"], rtol=0, atol=1e-9)
