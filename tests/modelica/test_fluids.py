"""What models of fluids need: flows that stop and turn, and levels that are compared with heights from the start on."""

import numpy as np

from acausal import simulate
from acausal.modelica import load

FLOW = """
package P
  connector Port
    Real p;
    Real h;
    flow Real m;
    flow Real H;
  end Port;
  partial model TwoPorts
    Port a;
    Port b;
    Real h;
    Real Q;
  equation
    a.m + b.m = 0;
    a.H = semiLinear(a.m, a.h, h);
    b.H = semiLinear(b.m, b.h, h);
  end TwoPorts;
  model Pipe
    extends TwoPorts(h(start = start, fixed = true));
    parameter Real start;
  equation
    a.p - b.p = a.m;
    a.H + b.H + Q = 0.1 * der(h);
    Q = 0;
  end Pipe;
  model Pump "without mass"
    extends TwoPorts;
    input Real m;
  equation
    a.m = m;
    a.H + b.H + Q = 0;
    Q = 0;
  end Pump;
  model Source
    Port port;
    parameter Real h;
  equation
    port.p = 0;
    port.H = semiLinear(port.m, port.h, h);
  end Source;
  model Net
    Source left(h = 1), right(h = 2);
    Pump pump(m = noEvent(if time < 1 then 0 elseif time < 2 then time - 1 elseif time < 3 then 0 else -1));
    Pipe one(start = 5), two(start = 6), last(start = 7);
  equation
    connect(left.port, pump.a);
    connect(pump.b, one.a);
    connect(pump.b, two.a);
    connect(one.b, last.a);
    connect(two.b, last.a);
    connect(last.b, right.port);
  end Net;
end P;
"""


def test_flows_that_are_zero_leave_no_value_open() -> None:
    """A chain through a pump without mass takes a value from one of its ends, a junction takes the mean."""
    s = simulate(load(FLOW, "P.Net"), 4.0, save=np.array([0.5, 1.5, 2.5, 3.5]), rtol=1e-9)
    h = {name: np.asarray(s[f"{name}.h"]) for name in ("one", "two", "last", "pump", "one.a")}
    for name, start in (("one", 5.0), ("two", 6.0)):
        # The flow through each of two equal pipes is half of that through the pump.
        np.testing.assert_allclose(h[name][:2], [start, 1 + (start - 1) * np.exp(-0.25 / 0.4)], rtol=1e-7)
    assert h["last"][0] == 7.0
    np.testing.assert_allclose(h["last"][3], 2 + (h["last"][2] - 2) * np.exp(-0.5 / 0.1), rtol=1e-7)
    mixed = [(1 + h["one"][i] + h["two"][i]) / 3 for i in (0, 2)]
    np.testing.assert_allclose(h["one.a"], [mixed[0], 1.0, mixed[1], (h["one"][3] + h["two"][3]) / 2])
    np.testing.assert_allclose(h["pump"], h["one.a"])


LEVELS = """
model Levels
  parameter Real start = 0.8;
  parameter Real heights[2] = {0.5, 0.9};
  Real level(start = start, fixed = true);
  Real height[2];
  Boolean above[2], low;
equation
  der(level) = -0.1;
  height = heights;
  for i in 1:2 loop
    above[i] = level >= height[i] + 0.4 or pre(above[i]) and level >= height[i] - 0.05;
  end for;
  low = pre(low) and level > 0.3;
initial equation
  for i in 1:2 loop
    pre(above[i]) = start >= height[i];
  end for;
  pre(low) = start > height[1];
end Levels;
"""


def test_initial_equations_of_previous_values() -> None:
    """Initial equations state `pre` of elements of an array, from variables."""
    s = simulate(load(LEVELS, "Levels"), 6.0, save=np.array([0.0, 3.4, 3.6, 4.9, 5.1]))
    np.testing.assert_array_equal(s["above"], [[1, 0], [1, 0], [0, 0], [0, 0], [0, 0]])
    np.testing.assert_array_equal(s["low"], [1, 1, 1, 1, 0])
